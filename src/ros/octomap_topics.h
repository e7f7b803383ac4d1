#pragma once
// The topics `octomap_markers`, `octomap_binary` and `octomap_full`.
#include <ros/node_handle.h>

#include <visualization_msgs/MarkerArray.h>

#include <functional>
#include <optional>

#include "octomap_message.h"
#include "planar_vslam/mapping2d/map_builder.h"

namespace planar_vslam::ros_face {

// `data` as MapBuilder::OctomapData gives it.
OctomapMessage ToOctomap(const std_msgs::Header& header, double resolution, const std::string& data, OctomapForm form);

class OctomapTopics {
 public:
  // `on_subscriber`: somebody has begun to listen to one of them, and expects the map of now.
  OctomapTopics(ros::NodeHandle* node, double resolution, const std::function<void()>& on_subscriber);
  // No `on_subscriber` is called any more.
  void Shutdown();

  // Those that somebody listens to.
  struct Messages {
    std::optional<visualization_msgs::MarkerArray> markers;
    std::optional<OctomapMessage> binary, full;
  };
  Messages Make(const std_msgs::Header& header, const MapBuilder& builder) const;
  void Publish(const Messages& messages) const;
  // That there is no map.
  void Clear(const std_msgs::Header& header) const;

 private:
  const double resolution_;  // m
  ros::Publisher markers_, binary_, full_;
};

}  // namespace planar_vslam::ros_face
