#pragma once
// Settings that change while the node runs, by dynamic_reconfigure.
#include <ros/node_handle.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "parameters.h"

namespace planar_vslam::ros_face {

// What is outside the bounds of cfg/Slam.cfg, or no band of heights; one line each.
std::vector<std::string> RunTimeProblems(const RunTimeSettings& settings);

class RunTimeServer {
 public:
  // `node`: the private one, whose parameters are set to `start` and to what they become. `apply` gets settings without
  // problems; others change nothing.
  RunTimeServer(const ros::NodeHandle& node, const RunTimeSettings& start,
                std::function<void(const RunTimeSettings&)> apply);
  ~RunTimeServer();
  RunTimeServer(const RunTimeServer&) = delete;
  RunTimeServer& operator=(const RunTimeServer&) = delete;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace planar_vslam::ros_face
