// A recorded drive played to slam_node on simulated time, against the command line's results on the same bag.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nav_msgs/GetMap.h>
#include <nav_msgs/OccupancyGrid.h>
#include <planar_vslam/LoadMap.h>
#include <planar_vslam/SaveMap.h>
#include <planar_vslam/SetMode.h>
#include <ros/ros.h>
#include <std_srvs/Empty.h>
#include <std_srvs/Trigger.h>
#include <tf2/buffer_core.h>
#include <tf2_ros/transform_listener.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <map>
#include <thread>

#include "planar_vslam/io/trajectory.h"
#include "planar_vslam/mapping2d/grid.h"
#include "replay_testing.h"
#include "support/support.h"

namespace planar_vslam::test {
namespace {

constexpr double kDriveSeconds = 12.0;

void Execute(const std::string& command) {
  if (std::system(command.c_str()) != 0) throw std::runtime_error("failed: " + command);
}

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

TEST_F(Replay, NothingIsFoundOnAGoodDrive) { EXPECT_EQ(listener_->findings(), "none"); }

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

TEST_F(Replay, StateSaysHowWellThePlaceIsKnown) {
  const State state = listener_->state();
  EXPECT_EQ(state.header.frame_id, "map");
  EXPECT_EQ(state.mode, "mapping");
  EXPECT_EQ(state.localised_by, "camera");
  EXPECT_GT(state.quality, 0.5);
  EXPECT_LE(state.quality, 1.0);
  EXPECT_GT(state.covariance[0], 0.0);
  EXPECT_GE(state.time_since_fix, 0.0);
  EXPECT_EQ(state.paused, 0);
}

TEST_F(Replay, StaticMapIsTheGrid) {
  nav_msgs::GetMap call;
  ASSERT_TRUE(ros::service::call("static_map", call));
  EXPECT_EQ(call.response.map.info.width, listener_->grid().info.width);
  EXPECT_EQ(call.response.map.data.size(), std::size_t{call.response.map.info.width} * call.response.map.info.height);
}

std::string Trigger(const std::string& service, bool expected) {
  std_srvs::Trigger call;
  EXPECT_TRUE(ros::service::call(service, call)) << service;
  EXPECT_EQ(call.response.success != 0, expected) << service << ": " << call.response.message;
  EXPECT_FALSE(call.response.message.empty()) << service;
  return call.response.message;
}

TEST_F(Replay, ResetDropsTheMap) {
  Trigger("reset", true);
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

SetMode::Response ChangeMode(const std::string& mode) {
  SetMode call;
  call.request.mode = mode;
  EXPECT_TRUE(ros::service::call("set_mode", call));
  return call.response;
}

LoadMap::Response Load(const std::string& name) {
  LoadMap call;
  call.request.name = name;
  EXPECT_TRUE(ros::service::call("load_map", call));
  return call.response;
}

TEST_F(Replay, MapsAreLoadedFromTheMapDirectoryAlone) {
  for (const char* name : {"rooms/lab", "rooms/lab.pvm", "rooms/lab"}) {
    const LoadMap::Response response = Load(name);
    EXPECT_TRUE(response.success) << response.message;
  }
  for (const std::string name : {"", "..", "/etc/passwd", "../lab", "nothing_there", "rooms/lab.yaml", "rooms/"}) {
    const LoadMap::Response response = Load(name);
    EXPECT_FALSE(response.success) << name;
    EXPECT_EQ(response.message.find('\n'), std::string::npos) << response.message;
  }
  EXPECT_TRUE(Save("still_there").success);
}

TEST_F(Replay, ServicesDoWhatTheyAreToldOrSayWhyNot) {
  std_srvs::Empty nothing;
  EXPECT_FALSE(ros::service::call("global_localization", nothing)) << "the map grows";
  Trigger("global_bundle_adjustment", true);
  Trigger("pause", true);
  Trigger("resume", true);
  for (const std::string mode : {"", "flying", "Localization", "localization "}) {
    const SetMode::Response response = ChangeMode(mode);
    EXPECT_FALSE(response.success) << mode;
    EXPECT_NE(response.message.find("expected mapping or localization"), std::string::npos) << response.message;
  }
  EXPECT_TRUE(ChangeMode("localization").success);
  Trigger("global_bundle_adjustment", false);
  EXPECT_TRUE(ros::service::call("global_localization", nothing));
  EXPECT_TRUE(ChangeMode("mapping").success);
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
