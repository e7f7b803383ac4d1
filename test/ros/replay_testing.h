#pragma once
// Plays a bag to the node on simulated time, and keeps what it answers.
#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/OccupancyGrid.h>
#include <planar_vslam/State.h>
#include <ros/ros.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <rosgraph_msgs/Clock.h>

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace planar_vslam::test {

using PoseMessage = geometry_msgs::PoseWithCovarianceStamped;

constexpr double kPlayRate = 2.0;
constexpr std::chrono::seconds kTrackingTimeout(300);

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
          findings_ = diagnostics->status.at(1).message;
        }));
    subscribers_.push_back(node.subscribe<State>("state", 10, [this](const State::ConstPtr& state) {
      const std::lock_guard<std::mutex> lock(mutex_);
      state_ = *state;
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
  State state() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return state_;
  }
  std::map<std::string, std::string> diagnostics() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return diagnostics_;
  }
  std::string findings() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return findings_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::map<ros::Time, PoseMessage> poses_;
  nav_msgs::OccupancyGrid grid_;
  State state_;
  std::map<std::string, std::string> diagnostics_;
  std::string findings_;  // what the status of findings says
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

}  // namespace planar_vslam::test
