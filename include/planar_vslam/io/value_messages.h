#pragma once
// Our values -> ROS messages without their headers, shared by the bag writer and the nodes. The message types are only
// named here.
#include <memory>
#include <optional>

#include "planar_vslam/sensor/camera_model.h"
#include "planar_vslam/sensor/measurements.h"

namespace nav_msgs {
template <class Allocator>
struct Odometry_;
using Odometry = Odometry_<std::allocator<void>>;
}  // namespace nav_msgs
namespace sensor_msgs {
template <class Allocator>
struct CameraInfo_;
template <class Allocator>
struct Image_;
template <class Allocator>
struct LaserScan_;
using CameraInfo = CameraInfo_<std::allocator<void>>;
using Image = Image_<std::allocator<void>>;
using LaserScan = LaserScan_<std::allocator<void>>;
}  // namespace sensor_msgs

namespace planar_vslam::io {

sensor_msgs::CameraInfo ToCameraInfo(const CameraModel& camera);
sensor_msgs::Image ToImage(const GrayImage& image);  // mono8
sensor_msgs::LaserScan ToLaserScan(const PlanarScan& scan);
// The twist is the mean since the reading before it.
nav_msgs::Odometry ToOdometry(const OdometryReading& reading, const std::optional<OdometryReading>& before);

}  // namespace planar_vslam::io
