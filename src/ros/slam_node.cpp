// slam_node: SlamApp as a process of its own.
#include <image_transport/exception.h>
#include <ros/ros.h>

#include <atomic>

#include "slam_app.h"

namespace planar_vslam::ros_face {
namespace {

int Run() {
  constexpr int kExitBadInput = 2;
  std::vector<std::string> problems;
  // Outlives everything: roscpp shuts down, its console first, with the last handle.
  const ros::NodeHandle private_node("~");
  const NodeSettings settings = ReadSettings(private_node, &problems);
  for (const std::string& problem : problems) ROS_FATAL("%s", problem.c_str());
  if (!problems.empty()) return kExitBadInput;
  std::atomic<bool> refused{false};
  const auto on_map_refused = [&refused](const std::string& reason) {
    ROS_FATAL("map_file: %s", reason.c_str());
    refused = true;
    ros::requestShutdown();
  };
  try {
    const SlamApp app(ros::NodeHandle(), private_node, ros::this_node::getName(), settings, on_map_refused);
    ros::spin();
  } catch (const image_transport::Exception& exception) {
    ROS_FATAL("image_transport: %s", exception.what());
    return kExitBadInput;
  }
  return refused ? kExitBadInput : 0;
}

}  // namespace
}  // namespace planar_vslam::ros_face

int main(int argc, char** argv) {
  ros::init(argc, argv, "slam_node");
  return planar_vslam::ros_face::Run();
}
