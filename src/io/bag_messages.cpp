#include "bag_messages.h"

#include <fmt/format.h>
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "image_decode.h"
#include "planar_vslam/sensor/lens.h"
#include "planar_vslam/sensor/scan_check.h"

namespace planar_vslam::io {
namespace {

// Of x, y and yaw from ROS' row-major [x, y, z, roll, pitch, yaw].
template <class Covariance>
Eigen::Matrix3d PlanarBlock(const Covariance& covariance) {
  constexpr std::array<std::size_t, 3> kPlanar = {0, 1, 5};
  constexpr std::size_t kRow = 6;
  Eigen::Matrix3d planar;
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) {
      planar(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = covariance[kRow * kPlanar[r] + kPlanar[c]];
    }
  }
  return planar;
}

// The images are that part of the sensor, that many times smaller, that the message says (REP 104): intrinsics, width
// and height are those of the whole sensor.
std::optional<Error> ApplyRoiAndBinning(const sensor_msgs::CameraInfo& info, const std::string& where,
                                        CameraModel* camera) {
  const auto& roi = info.roi;
  const bool whole = roi.width == 0 || roi.height == 0;
  const auto end_x = static_cast<std::uint64_t>(roi.x_offset) + roi.width;
  const auto end_y = static_cast<std::uint64_t>(roi.y_offset) + roi.height;
  if (end_x > info.width || end_y > info.height) {
    return Error{fmt::format("{}: roi of {}x{} at ({}, {}) leaves the sensor; expected it inside {}x{}", where,
                             roi.width, roi.height, roi.x_offset, roi.y_offset, info.width, info.height)};
  }
  const std::uint32_t binning_x = std::max(info.binning_x, 1U), binning_y = std::max(info.binning_y, 1U);
  camera->width = static_cast<int>((whole ? info.width : roi.width) / binning_x);
  camera->height = static_cast<int>((whole ? info.height : roi.height) / binning_y);
  camera->fx /= binning_x;
  camera->fy /= binning_y;
  camera->cx = (camera->cx - (whole ? 0 : roi.x_offset)) / binning_x;
  camera->cy = (camera->cy - (whole ? 0 : roi.y_offset)) / binning_y;
  return std::nullopt;
}

// Whether angle_max is far from where the beams end by angle_min and angle_increment: then nobody knows which is wrong.
// Drivers round it, or count a beam more or less from sweep to sweep, or leave it at 0.
bool AnglesContradict(const sensor_msgs::LaserScan& scan) {
  constexpr double kSlack = 0.25;  // of the angle that the beams span
  const double span = static_cast<double>(scan.angle_increment) * (static_cast<double>(scan.ranges.size()) - 1.0);
  const double end = static_cast<double>(scan.angle_min) + span;
  return scan.angle_max != 0.0F && std::abs(static_cast<double>(scan.angle_max) - end) > kSlack * std::abs(span);
}

}  // namespace

Rigid3 ToRigid3(const geometry_msgs::Transform& transform) {
  const auto& t = transform.translation;
  const auto& q = transform.rotation;
  return {Eigen::Quaterniond(q.w, q.x, q.y, q.z), Eigen::Vector3d(t.x, t.y, t.z)};
}

bool IsRotation(const Eigen::Quaterniond& rotation) {
  constexpr double kTolerance = 1e-2;
  return std::abs(rotation.norm() - 1.0) < kTolerance;
}

OdometryMessageCovariance ToOdometryCovariance(const nav_msgs::Odometry& odometry, const Rigid3& T_child_base) {
  constexpr double kSamePlace = 1e-6;  // m and rad
  const Rigid2 planar = ProjectToPlane(T_child_base);
  if (planar.translation.norm() > kSamePlace || std::abs(planar.angle) > kSamePlace) return {};
  return {PlanarBlock(odometry.pose.covariance), PlanarBlock(odometry.twist.covariance)};
}

Expected<PlanarScan> ToPlanarScan(const sensor_msgs::LaserScan& scan) {
  PlanarScan planar;
  planar.stamp = ToTimestamp(scan.header.stamp);
  planar.angle_min = static_cast<double>(scan.angle_min);
  planar.angle_increment = static_cast<double>(scan.angle_increment);
  const double beams = static_cast<double>(scan.ranges.size());
  if (scan.angle_increment == 0.0F && beams > 1.0) {  // not filled in, where both ends may be
    planar.angle_increment = static_cast<double>(scan.angle_max - scan.angle_min) / (beams - 1.0);
  }
  planar.range_min = static_cast<double>(scan.range_min);
  planar.range_max = static_cast<double>(scan.range_max);
  planar.ranges = scan.ranges;
  Expected<PlanarScan> checked = CheckedScan(std::move(planar));
  if (checked.ok() && scan.angle_increment != 0.0F && AnglesContradict(scan)) {
    return Error{"scan whose angle_max contradicts angle_min and angle_increment"};
  }
  return checked;
}

Expected<Rigid3> ToOdometryPose(const nav_msgs::Odometry& odometry) {
  const auto& p = odometry.pose.pose.position;
  const auto& q = odometry.pose.pose.orientation;
  const Rigid3 T(Eigen::Quaterniond(q.w, q.x, q.y, q.z), Eigen::Vector3d(p.x, p.y, p.z));
  if (!T.translation.allFinite() || !T.rotation.coeffs().allFinite()) return Error{"odometry pose not finite"};
  if (!IsRotation(T.rotation)) return Error{"odometry orientation is no unit quaternion"};
  return Rigid3(T.rotation.normalized(), T.translation);
}

std::optional<Eigen::Vector3d> ToOdometryTwist(const nav_msgs::Odometry& odometry) {
  const auto& twist = odometry.twist.twist;
  const Eigen::Vector3d planar(twist.linear.x, twist.linear.y, twist.angular.z);
  if (!planar.allFinite()) return std::nullopt;
  return planar;
}

bool IsFilledIn(const sensor_msgs::CameraInfo& info, bool rectified) {
  return rectified ? info.P[0] != 0.0 : info.K[0] != 0.0 || info.K[4] != 0.0;
}

Expected<CameraModel> ToCameraModel(const sensor_msgs::CameraInfo& info, const std::string& where, bool rectified) {
  CameraModel camera;
  camera.fx = rectified ? info.P[0] : info.K[0];
  camera.cx = rectified ? info.P[2] : info.K[2];
  camera.fy = rectified ? info.P[5] : info.K[4];
  camera.cy = rectified ? info.P[6] : info.K[5];
  if (const auto error = ApplyRoiAndBinning(info, where, &camera)) return *error;
  if (!rectified) {
    const Expected<bool> lens = SetLens({info.distortion_model, info.D}, &camera);
    if (!lens) return Error{fmt::format("{}: {}", where, lens.error().message)};
  }
  const std::vector<std::string> problems = camera.Problems();
  if (!problems.empty()) return Error{fmt::format("{}: {}", where, fmt::join(problems, "; "))};
  return camera;
}

Expected<GrayImage> ToGrayImage(const sensor_msgs::CompressedImage& image, GreyDepth* depth) {
  std::optional<GrayImage> gray = DecodeImage(image.data, depth);
  if (gray.has_value()) return std::move(*gray);
  return Error{fmt::format("image of {} bytes, format '{}', not decodable; expected {}", image.data.size(),
                           image.format, kImageFormats)};
}

Expected<GrayImage> ToGrayImage(const sensor_msgs::Image& image, GreyDepth* depth) {
  RawImage raw;
  raw.width = static_cast<int>(image.width);
  raw.height = static_cast<int>(image.height);
  raw.row_bytes = image.step;
  raw.encoding = image.encoding;
  raw.big_endian = image.is_bigendian != 0;
  raw.data = &image.data;
  return ConvertImage(raw, depth);
}

StampedImage ReadImage(const StoredMessage& message, bool compressed, GreyDepth* depth) {
  if (compressed) {
    const auto image = message.Read<sensor_msgs::CompressedImage>();
    return {image->header.stamp, image->header.frame_id, ToGrayImage(*image, depth)};
  }
  const auto image = message.Read<sensor_msgs::Image>();
  return {image->header.stamp, image->header.frame_id, ToGrayImage(*image, depth)};
}

}  // namespace planar_vslam::io
