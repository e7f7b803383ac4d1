#pragma once
// ROS messages -> our values, shared by the bag reader and the nodes. The message types are only named here.
#include <memory>
#include <string>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/planar/message_covariance.h"
#include "planar_vslam/sensor/camera_model.h"
#include "planar_vslam/sensor/measurements.h"

namespace geometry_msgs {
template <class Allocator>
struct Transform_;
using Transform = Transform_<std::allocator<void>>;
}  // namespace geometry_msgs
namespace nav_msgs {
template <class Allocator>
struct Odometry_;
using Odometry = Odometry_<std::allocator<void>>;
}  // namespace nav_msgs
namespace sensor_msgs {
template <class Allocator>
struct CameraInfo_;
template <class Allocator>
struct CompressedImage_;
template <class Allocator>
struct Image_;
template <class Allocator>
struct LaserScan_;
using CameraInfo = CameraInfo_<std::allocator<void>>;
using CompressedImage = CompressedImage_<std::allocator<void>>;
using Image = Image_<std::allocator<void>>;
using LaserScan = LaserScan_<std::allocator<void>>;
}  // namespace sensor_msgs

namespace planar_vslam::io {

Rigid3 ToRigid3(const geometry_msgs::Transform& transform);
PlanarScan ToPlanarScan(const sensor_msgs::LaserScan& scan);
// What the message says of x, y and yaw. None (zero) where the base is not above or below its child frame: what it says
// is about another point then.
OdometryMessageCovariance ToOdometryCovariance(const nav_msgs::Odometry& odometry, const Rigid3& T_child_base);

// `where` (file or node, and topic) is named in errors. A rectified image takes P without distortion.
Expected<CameraModel> ToCameraModel(const sensor_msgs::CameraInfo& info, const std::string& where, bool rectified);

Expected<GrayImage> ToGrayImage(const sensor_msgs::Image& image);
Expected<GrayImage> ToGrayImage(const sensor_msgs::CompressedImage& image);

// An image image_proc has rectified: its intrinsics are the P of the camera_info, without distortion.
bool IsRectifiedImage(const std::string& topic);

// Without the leading slash tf's first generation used.
std::string FrameName(const std::string& frame_id);

}  // namespace planar_vslam::io
