#include "octomap_topics.h"

#include <string>

#include "markers.h"

namespace planar_vslam::ros_face {

OctomapMessage ToOctomap(const std_msgs::Header& header, double resolution, const std::string& data, OctomapForm form) {
  OctomapMessage message;
  message.header = header;
  message.binary = static_cast<std::uint8_t>(form == OctomapForm::kBinary);
  message.id = "OcTree";
  message.resolution = resolution;
  message.data.assign(data.begin(), data.end());
  return message;
}

OctomapTopics::OctomapTopics(ros::NodeHandle* node, double resolution, const std::function<void()>& on_subscriber)
    : resolution_(resolution) {
  const auto advertise = [node, connected = [on_subscriber](const ros::SingleSubscriberPublisher&) {
    on_subscriber();
  }](auto message, const std::string& topic) { return node->advertise<decltype(message)>(topic, 1, connected); };
  markers_ = advertise(visualization_msgs::MarkerArray(), "octomap_markers");
  binary_ = advertise(OctomapMessage(), "octomap_binary");
  full_ = advertise(OctomapMessage(), "octomap_full");
}

void OctomapTopics::Shutdown() {
  for (ros::Publisher* publisher : {&markers_, &binary_, &full_}) publisher->shutdown();
}

OctomapTopics::Messages OctomapTopics::Make(const std_msgs::Header& header, const MapBuilder& builder) const {
  const auto tree = [&](OctomapForm form) { return ToOctomap(header, resolution_, builder.OctomapData(form), form); };
  Messages messages;
  if (markers_.getNumSubscribers() > 0) {
    messages.markers = ToOctomapMarkers(header, resolution_, builder.OccupiedCubes());
  }
  if (binary_.getNumSubscribers() > 0) messages.binary = tree(OctomapForm::kBinary);
  if (full_.getNumSubscribers() > 0) messages.full = tree(OctomapForm::kFull);
  return messages;
}

void OctomapTopics::Publish(const Messages& messages) const {
  if (messages.markers.has_value()) markers_.publish(*messages.markers);
  if (messages.binary.has_value()) binary_.publish(*messages.binary);
  if (messages.full.has_value()) full_.publish(*messages.full);
}

void OctomapTopics::Clear(const std_msgs::Header& header) const {
  markers_.publish(ToOctomapMarkers(header, resolution_, {}));
  binary_.publish(ToOctomap(header, resolution_, "", OctomapForm::kBinary));
  full_.publish(ToOctomap(header, resolution_, "", OctomapForm::kFull));
}

}  // namespace planar_vslam::ros_face
