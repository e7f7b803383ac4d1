#pragma once
// The parameters of the navigator's node.
#include <ros/node_handle.h>

#include <string>
#include <vector>

#include "planar_vslam/navigate/options.h"

namespace planar_vslam::ros_face {

struct NavigatorSettings {
  NavigateOptions options;
  std::string map_frame = "map", odom_frame = "odom", base_frame = "base_footprint";
  double rate = 10.0;  // Hz
};

// Problems are appended, one line each.
NavigatorSettings ReadNavigatorSettings(const ros::NodeHandle& node, std::vector<std::string>* problems);

}  // namespace planar_vslam::ros_face
