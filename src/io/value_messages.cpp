#include "planar_vslam/io/value_messages.h"

#include <nav_msgs/Odometry.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/LaserScan.h>

#include <algorithm>

#include "planar_vslam/sensor/lens.h"

namespace planar_vslam::io {

sensor_msgs::CameraInfo ToCameraInfo(const CameraModel& camera) {
  sensor_msgs::CameraInfo info;
  info.width = static_cast<std::uint32_t>(camera.width);
  info.height = static_cast<std::uint32_t>(camera.height);
  LensText lens = DescribeLens(camera);
  info.distortion_model = std::move(lens.model);
  info.D = std::move(lens.coefficients);
  info.K = {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
  info.R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.P = {camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0};
  return info;
}

sensor_msgs::Image ToImage(const GrayImage& image) {
  sensor_msgs::Image message;
  message.width = static_cast<std::uint32_t>(image.width);
  message.height = static_cast<std::uint32_t>(image.height);
  message.encoding = "mono8";
  message.step = message.width;
  message.data = *image.pixels;
  return message;
}

sensor_msgs::LaserScan ToLaserScan(const PlanarScan& scan) {
  sensor_msgs::LaserScan message;
  message.angle_min = static_cast<float>(scan.angle_min);
  message.angle_increment = static_cast<float>(scan.angle_increment);
  message.angle_max = static_cast<float>(
      scan.angle_min + scan.angle_increment * static_cast<double>(std::max<std::size_t>(scan.ranges.size(), 1) - 1));
  message.range_min = static_cast<float>(scan.range_min);
  message.range_max = static_cast<float>(scan.range_max);
  message.ranges = scan.ranges;
  return message;
}

nav_msgs::Odometry ToOdometry(const OdometryReading& reading, const std::optional<OdometryReading>& before) {
  nav_msgs::Odometry message;
  const Rigid3 T = Embed3(reading.T_odom_base);
  message.pose.pose.position.x = T.translation.x();
  message.pose.pose.position.y = T.translation.y();
  message.pose.pose.orientation.x = T.rotation.x(), message.pose.pose.orientation.y = T.rotation.y();
  message.pose.pose.orientation.z = T.rotation.z(), message.pose.pose.orientation.w = T.rotation.w();
  if (!before.has_value() || reading.stamp <= before->stamp) return message;
  const Eigen::Vector3d twist =
      LogSe2(before->T_odom_base.Inverse() * reading.T_odom_base) / SecondsBetween(before->stamp, reading.stamp);
  message.twist.twist.linear.x = twist.x();
  message.twist.twist.linear.y = twist.y();
  message.twist.twist.angular.z = twist.z();
  return message;
}

}  // namespace planar_vslam::io
