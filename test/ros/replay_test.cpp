// A recorded drive played to slam_node on simulated time, against the command line's results on the same bag.
#include <diagnostic_msgs/DiagnosticArray.h>
#include <fmt/format.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <gtest/gtest.h>
#include <nav_msgs/OccupancyGrid.h>
#include <planar_vslam/SaveMap.h>
#include <ros/ros.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <rosgraph_msgs/Clock.h>
#include <std_srvs/Trigger.h>
#include <tf2/buffer_core.h>
#include <tf2_ros/transform_listener.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdlib>
#include <map>
#include <mutex>
#include <thread>

#include "planar_vslam/io/trajectory.h"
#include "planar_vslam/mapping2d/grid.h"
#include "support/support.h"

namespace planar_vslam::test {
namespace {

using PoseMessage = geometry_msgs::PoseWithCovarianceStamped;

constexpr double kDriveSeconds = 12.0;
constexpr double kPlayRate = 2.0;
constexpr std::chrono::seconds kTrackingTimeout(300);

void Execute(const std::string& command) {
  if (std::system(command.c_str()) != 0) throw std::runtime_error("failed: " + command);
}

// Everything the node publishes that the tests look at.
class Listener {
 public:
  Listener() {
    ros::NodeHandle node;
    subscribers_.push_back(node.subscribe<PoseMessage>("pose", 0, [this](const PoseMessage::ConstPtr& pose) {
      const std::lock_guard<std::mutex> lock(mutex_);
      poses_[pose->header.stamp] = *pose;
      changed_.notify_all();
    }));
    subscribers_.push_back(
        node.subscribe<nav_msgs::OccupancyGrid>("map", 1, [this](const nav_msgs::OccupancyGrid::ConstPtr& map) {
          const std::lock_guard<std::mutex> lock(mutex_);
          grid_ = *map;
        }));
    subscribers_.push_back(node.subscribe<diagnostic_msgs::DiagnosticArray>(
        "/diagnostics", 10, [this](const diagnostic_msgs::DiagnosticArray::ConstPtr& diagnostics) {
          const std::lock_guard<std::mutex> lock(mutex_);
          for (const auto& pair : diagnostics->status.at(0).values) diagnostics_[pair.key] = pair.value;
        }));
  }

  bool WaitForPose(const ros::Time& stamp) {
    std::unique_lock<std::mutex> lock(mutex_);
    return changed_.wait_for(lock, kTrackingTimeout,
                             [&] { return !poses_.empty() && poses_.rbegin()->first >= stamp; });
  }
  std::map<ros::Time, PoseMessage> poses() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return poses_;
  }
  nav_msgs::OccupancyGrid grid() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return grid_;
  }
  std::map<std::string, std::string> diagnostics() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return diagnostics_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::map<ros::Time, PoseMessage> poses_;
  nav_msgs::OccupancyGrid grid_;
  std::map<std::string, std::string> diagnostics_;
  std::vector<ros::Subscriber> subscribers_;
};

// Publishes a bag and its clock.
class Player {
 public:
  explicit Player(const std::filesystem::path& path) : bag_(path.string()), view_(bag_) {
    ros::NodeHandle node;
    clock_ = node.advertise<rosgraph_msgs::Clock>("/clock", 10);
    for (const rosbag::ConnectionInfo* connection : view_.getConnections()) {
      ros::AdvertiseOptions options(connection->topic, 0, connection->md5sum, connection->datatype,
                                    connection->msg_def);
      options.latch = connection->topic == "/tf_static";
      publishers_.emplace(connection->topic, node.advertise(options));
    }
  }

  void Play() {
    for (const auto& [topic, publisher] : publishers_) {
      while (ros::ok() && publisher.getNumSubscribers() == 0)
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    const auto start = std::chrono::steady_clock::now();
    for (const rosbag::MessageInstance& message : view_) {
      const double seconds = (message.getTime() - view_.getBeginTime()).toSec() / kPlayRate;
      std::this_thread::sleep_until(start + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                                                std::chrono::duration<double>(seconds)));
      rosgraph_msgs::Clock clock;
      clock.clock = message.getTime();
      clock_.publish(clock);
      publishers_.at(message.getTopic()).publish(message);
    }
  }

 private:
  rosbag::Bag bag_;
  rosbag::View view_;
  ros::Publisher clock_;
  std::map<std::string, ros::Publisher> publishers_;
};

Rigid3 PoseOf(const PoseMessage& message) {
  const auto& p = message.pose.pose.position;
  const auto& q = message.pose.pose.orientation;
  return {Eigen::Quaterniond(q.w, q.x, q.y, q.z), Eigen::Vector3d(p.x, p.y, p.z)};
}

class Replay : public ::testing::Test {
 protected:
  // Records (or simulates) the drive, runs the command line on it, then plays it to the node.
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder();
    const std::string work = folder_->path().string();
    std::string dataset = ros::NodeHandle("~").param<std::string>("dataset", "");
    if (dataset.empty()) {
      dataset = work + "/drive";
      Execute(fmt::format("{} simulate sample_lab --out {} --until {}", test::Executable(), dataset, kDriveSeconds));
    }
    Execute(fmt::format("{}/test/ros/dataset_to_bag.py {} {}/drive.bag --until {}", test::SourceFolder().string(),
                        dataset, work, kDriveSeconds));
    Execute(fmt::format("{} run {}/drive.bag --out {}/reference --quiet", test::Executable(), work, work));
    reference_ = new Trajectory(ReadTrajectory(work + "/reference/trajectory_live.txt").value());
    listener_ = new Listener();
    tf_ = new tf2_ros::Buffer(ros::Duration(60.0));
    tf_listener_ = new tf2_ros::TransformListener(*tf_);
    Player(folder_->path() / "drive.bag").Play();
    // The last images may wait for odometry the recording does not hold any more.
    constexpr std::int64_t kTailNanoseconds = 300'000'000;
    const std::int64_t last = reference_->back().stamp.nanoseconds - kTailNanoseconds;
    complete_ = listener_->WaitForPose(ros::Time().fromNSec(static_cast<std::uint64_t>(last)));
  }
  static void TearDownTestSuite() {
    std::filesystem::remove_all(ros::NodeHandle().param<std::string>("/slam/map_directory", ""));
    delete tf_listener_;
    delete tf_;
    delete listener_;
    delete reference_;
    delete folder_;
  }

  static SaveMap::Response Save(const std::string& name) {
    SaveMap call;
    call.request.name = name;
    EXPECT_TRUE(ros::service::call("save_map", call));
    return call.response;
  }

  static TemporaryFolder* folder_;
  static Trajectory* reference_;
  static Listener* listener_;
  static tf2_ros::Buffer* tf_;
  static tf2_ros::TransformListener* tf_listener_;
  static bool complete_;
};
TemporaryFolder* Replay::folder_ = nullptr;
Trajectory* Replay::reference_ = nullptr;
Listener* Replay::listener_ = nullptr;
tf2_ros::Buffer* Replay::tf_ = nullptr;
tf2_ros::TransformListener* Replay::tf_listener_ = nullptr;
bool Replay::complete_ = false;

// Played losslessly, the node does what the command line does; only the transforms' rounding differs.
TEST_F(Replay, PosesAreThoseOfTheCommandLine) {
  ASSERT_TRUE(complete_) << "poses did not reach the end of the drive";
  double squares = 0.0, worst = 0.0;
  std::size_t pairs = 0;
  const std::map<ros::Time, PoseMessage> poses = listener_->poses();
  for (const StampedPose& expected : *reference_) {
    const auto pose = poses.find(ros::Time().fromNSec(static_cast<std::uint64_t>(expected.stamp.nanoseconds)));
    if (pose == poses.end()) continue;
    EXPECT_EQ(pose->second.header.frame_id, "map");
    const double error = (PoseOf(pose->second).translation - expected.T_map_base.translation).norm();
    squares += error * error;
    worst = std::max(worst, error);
    ++pairs;
  }
  constexpr std::size_t kMissing = 4;  // at the end of the drive
  ASSERT_GE(pairs + kMissing, reference_->size());
  const double rmse = std::sqrt(squares / static_cast<double>(pairs));
  fmt::print("{} poses, difference rmse {:.4f} m, max {:.4f} m\n", pairs, rmse, worst);
  EXPECT_LT(rmse, 0.01);
  EXPECT_LT(worst, 0.02);
}

TEST_F(Replay, CovariancesAreCovariances) {
  for (const auto& [stamp, pose] : listener_->poses()) {
    const Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> covariance(pose.pose.covariance.data());
    ASSERT_TRUE(covariance.allFinite());
    ASSERT_LT((covariance - covariance.transpose()).cwiseAbs().maxCoeff(), 1e-9);
    ASSERT_GT(covariance.diagonal().minCoeff(), 0.0);
  }
}

// map -> odom is dated ahead of the odometry, so tf reaches every stamp at which odometry is known.
TEST_F(Replay, TransformsPutTheRobotAtItsPose) {
  ASSERT_TRUE(complete_);
  const auto poses = listener_->poses();
  const auto& [stamp, pose] = *poses.rbegin();
  // The pose and the transforms come over different connections, and the clock stands still by now: wall time it is.
  std::string why;
  bool reached = false;
  for (int i = 0; i < 250 && !reached; ++i) {
    reached = tf_->canTransform("map", "base_footprint", stamp, ros::Duration(0.0), &why);
    if (!reached) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  ASSERT_TRUE(reached) << why;
  const auto base = tf_->lookupTransform("map", "base_footprint", stamp).transform.translation;
  EXPECT_NEAR(base.x, pose.pose.pose.position.x, 0.05);
  EXPECT_NEAR(base.y, pose.pose.pose.position.y, 0.05);
  EXPECT_EQ(base.z, 0.0);
}

TEST_F(Replay, MapShowsFloorAndObstacles) {
  const nav_msgs::OccupancyGrid grid = listener_->grid();
  ASSERT_EQ(grid.data.size(), std::size_t{grid.info.width} * grid.info.height);
  EXPECT_EQ(grid.header.frame_id, "map");
  EXPECT_EQ(grid.info.origin.orientation.w, 1.0);
  EXPECT_GT(std::count(grid.data.begin(), grid.data.end(), 0), 100);
  EXPECT_GT(std::count(grid.data.begin(), grid.data.end(), 100), 20);
}

TEST_F(Replay, DiagnosticsSpeakOfTracking) {
  const std::map<std::string, std::string> values = listener_->diagnostics();
  ASSERT_EQ(values.count("state"), 1U);
  EXPECT_EQ(values.at("state"), "tracking");
  EXPECT_EQ(values.at("metric"), "true");
  EXPECT_EQ(values.at("dropped images"), "0");
  EXPECT_GE(std::stoi(values.at("keyframes")), 2);
  for (const char* stage : {"frame.extract", "track.match", "map.triangulate", "frame.total"}) {
    EXPECT_EQ(values.count(std::string(stage) + " p50, p99 (ms)"), 1U) << stage;
  }
}

TEST_F(Replay, SavedMapCanBeReadBack) {
  const SaveMap::Response response = Save("rooms/lab");
  ASSERT_TRUE(response.success) << response.message;
  const Expected<OccupancyGrid2d> grid = ReadMapServerFiles(response.message);
  ASSERT_TRUE(grid.ok()) << grid.error().message;
  EXPECT_GT(std::count(grid->cells.begin(), grid->cells.end(), 0), 100);
}

TEST_F(Replay, MapsAreNotSavedElsewhere) {
  for (const std::string name : {"", ".", "..", "../lab", "rooms/../../lab", "/tmp/lab", "rooms/"}) {
    const SaveMap::Response response = Save(name);
    EXPECT_FALSE(response.success) << "'" << name << "' went to " << response.message;
    EXPECT_FALSE(response.message.empty());
  }
}

TEST_F(Replay, ResetDropsTheMap) {
  std_srvs::Trigger reset;
  ASSERT_TRUE(ros::service::call("reset", reset));
  EXPECT_TRUE(reset.response.success);
  EXPECT_FALSE(Save("after_reset").success);
  // Who has subscribed is told that nothing is known any more.
  const auto knows_something = [this] {
    const nav_msgs::OccupancyGrid grid = listener_->grid();
    return std::any_of(grid.data.begin(), grid.data.end(), [](std::int8_t cell) { return cell != -1; });
  };
  for (int i = 0; i < 250 && knows_something(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_FALSE(listener_->grid().data.empty());
  EXPECT_FALSE(knows_something());
}

}  // namespace
}  // namespace planar_vslam::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "replay_test");
  ros::AsyncSpinner spinner(1);
  spinner.start();
  return RUN_ALL_TESTS();
}
