#pragma once
// Stored ROS messages -> our values.
#include <geometry_msgs/Transform.h>
#include <ros/time.h>
#include <rosbag/message_instance.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/LaserScan.h>
#include <std_msgs/Header.h>

#include <string>

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
StampedImage ReadImage(const rosbag::MessageInstance& message, bool compressed, GreyDepth* depth);
// The header that every message of ours begins with; throws where the message is too short for one.
std_msgs::Header ReadHeader(const rosbag::MessageInstance& message);

// The message as M; throws rosbag::BagFormatException where the bag's definition of the type is another.
template <class M>
boost::shared_ptr<M> Instantiate(const rosbag::MessageInstance& message) {
  boost::shared_ptr<M> instance = message.instantiate<M>();
  if (instance == nullptr) {
    throw rosbag::BagFormatException("topic " + message.getTopic() + " has another definition of " +
                                     message.getDataType());
  }
  return instance;
}

}  // namespace planar_vslam::io
