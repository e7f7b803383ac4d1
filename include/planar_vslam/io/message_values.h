#pragma once
// ROS messages -> our values, shared by the bag reader and the nodes. The message types are only named here.
#include <memory>
#include <optional>
#include <string>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/io/grey_depth.h"
#include "planar_vslam/planar/message_covariance.h"
#include "planar_vslam/sensor/camera_model.h"
#include "planar_vslam/sensor/lens.h"
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

// One function for each type of message: what it is checked for is the same wherever it comes from. Errors are reasons
// to count messages by: they name what is wrong, not the values. Stamps are the caller's.

// A rotation that is not of unit length says nothing (ToOdometryPose, and tf's readers, look).
Rigid3 ToRigid3(const geometry_msgs::Transform& transform);
// Of length 1, up to single precision and filters that let it drift.
bool IsRotation(const Eigen::Quaterniond& rotation);

Expected<PlanarScan> ToPlanarScan(const sensor_msgs::LaserScan& scan);

// T_odom_child, of finite numbers and a unit quaternion.
Expected<Rigid3> ToOdometryPose(const nav_msgs::Odometry& odometry);
// Of the child frame in its plane: m/s, m/s, rad/s; nothing where it is not finite.
std::optional<Eigen::Vector3d> ToOdometryTwist(const nav_msgs::Odometry& odometry);
// What the message says of x, y and yaw. None (zero) where the base is not above or below its child frame: what it says
// is about another point then.
OdometryMessageCovariance ToOdometryCovariance(const nav_msgs::Odometry& odometry, const Rigid3& T_child_base);

// Drivers send zeros until they have read their calibration.
bool IsFilledIn(const sensor_msgs::CameraInfo& info, bool rectified);
// `where` (file or node, and topic) is named in errors. A rectified image takes P without distortion. Binning and
// region of interest are applied (REP 104).
Expected<CameraModel> ToCameraModel(const sensor_msgs::CameraInfo& info, const std::string& where, bool rectified);

// `depth` is that of the stream.
Expected<GrayImage> ToGrayImage(const sensor_msgs::Image& image, GreyDepth* depth);
Expected<GrayImage> ToGrayImage(const sensor_msgs::CompressedImage& image, GreyDepth* depth);

// Images without distortion, whose intrinsics are the P of the camera_info: as the user says, or where a word of the
// topic's last name is `rect` or `rectified` (image_rect of image_proc, image_color_rect of kinect2_bridge).
bool IsRectifiedImage(const std::string& topic, RectifiedImages said);

// Without the leading slash tf's first generation used.
std::string FrameName(const std::string& frame_id);

}  // namespace planar_vslam::io
