#pragma once
// Tracking and mapping with its topics and services: what node and nodelet have in common.
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "parameters.h"

namespace planar_vslam::ros_face {

class SlamApp {
 public:
  // `name` is what diagnostics go by. `on_map_refused`: ~map_file does not fit the camera; nothing is tracked until
  // another map is loaded. Throws image_transport::Exception where that plugin is missing.
  // `private_node`: whose parameters the settings were read from, and which change with them.
  SlamApp(const ros::NodeHandle& node, const ros::NodeHandle& private_node, const std::string& name,
          const NodeSettings& settings, std::function<void(const std::string&)> on_map_refused);
  ~SlamApp();
  SlamApp(const SlamApp&) = delete;
  SlamApp& operator=(const SlamApp&) = delete;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace planar_vslam::ros_face
