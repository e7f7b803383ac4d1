#pragma once
// What a simulated robot says: its sensors, its transforms, the clock, and the truth.
#include <image_transport/image_transport.h>
#include <ros/node_handle.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>

#include <map>
#include <optional>
#include <string>

#include "planar_vslam/sim/sensor_rig.h"

namespace planar_vslam::ros_face {

// Simulated second 0 is second 1 here: to ROS, a stamp of zero is none.
ros::Time SimTime(Timestamp stamp);

// Of the truth, and of the places a robot is carried to.
inline constexpr char kSimWorldFrame[] = "world";

class SimPublisher {
 public:
  SimPublisher(ros::NodeHandle* node, const World& world);

  void PublishClock(double now);  // s
  void Publish(const SimulatedEvent& event);
  // `level` as diagnostic_msgs/DiagnosticStatus has it.
  void PublishDiagnostics(double now, signed char level, const std::string& message,
                          const std::map<std::string, std::string>& values);

 private:
  void PublishTruth(Timestamp stamp, const Rigid3& T_world_base);
  void PublishFixedTransforms(const World& world);

  image_transport::ImageTransport transport_;
  image_transport::Publisher image_;
  ros::Publisher camera_info_, scan_, odometry_, truth_, truth_map_, clock_, diagnostics_;
  tf2_ros::TransformBroadcaster broadcaster_;
  tf2_ros::StaticTransformBroadcaster static_broadcaster_;
  CameraModel camera_;
  bool head_moves_;
  std::optional<OdometryReading> last_reading_;
  std::optional<std::pair<Timestamp, Rigid3>> last_truth_;
};

}  // namespace planar_vslam::ros_face
