#pragma once
// sim_node's private parameters.
#include <ros/node_handle.h>

#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/sim/live_simulation.h"

namespace planar_vslam::ros_face {

struct SimSettings {
  std::string world_name;               // ~world: a YAML file, or the name of a shipped world
  std::optional<LiveSimulation> robot;  // in that world as ~drive, ~variants and ~seed make it; from ~start
  double rate = 1.0;                    // ~rate: simulated seconds in a second; 0: as fast as possible
  double start_delay = 0.0;             // ~start_delay: s of wall time before the clock starts
};

// One line in `problems` for everything that is wrong, unknown parameters included; then there is no robot.
SimSettings ReadSimSettings(const ros::NodeHandle& node, std::vector<std::string>* problems);

}  // namespace planar_vslam::ros_face
