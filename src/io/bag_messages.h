#pragma once
// Stored ROS messages -> our values.
#include <geometry_msgs/Transform.h>
#include <ros/time.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/LaserScan.h>
#include <std_msgs/Header.h>

#include <string>

#include "bag_message.h"
#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/io/message_values.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam::io {

inline Timestamp ToTimestamp(const ros::Time& time) { return {static_cast<std::int64_t>(time.toNSec())}; }

// A stored sensor_msgs/Image or CompressedImage.
struct StampedImage {
  ros::Time stamp;
  std::string frame_id;
  Expected<GrayImage> image;
};
StampedImage ReadImage(const StoredMessage& message, bool compressed, GreyDepth* depth);

}  // namespace planar_vslam::io
