#pragma once
// demo_goals' private parameters.
#include <ros/node_handle.h>

#include <string>
#include <vector>

#include "planar_vslam/geometry/angles.h"
#include "planar_vslam/navigate/goal_drawing.h"

namespace planar_vslam::ros_face {

struct DemoSettings {
  GoalDrawing drawing;                          // ~goals, ~seed
  std::string map_name = "demo";                // ~map_name: in slam_node's ~map_directory
  double largest_error = 0.12;                  // ~max_error: m, true
  double largest_turn = DegreesToRadians(6.0);  // ~max_error_deg: true
  double longest = 300.0;                       // ~goal_timeout: s of simulated time
  double patience = 120.0;                      // ~patience: s of wall time, for an answer
};

// One line in `problems` for everything that is wrong, unknown parameters included.
DemoSettings ReadDemoSettings(const ros::NodeHandle& node, std::vector<std::string>* problems);

}  // namespace planar_vslam::ros_face
