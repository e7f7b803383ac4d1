#include "bag_messages.h"

#include <fmt/format.h>
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "image_decode.h"

namespace planar_vslam::io {
namespace {

// Distortion coefficients D = k1 k2 p1 p2 k3.
std::optional<Error> SetDistortion(const sensor_msgs::CameraInfo& info, const std::string& where, CameraModel* camera) {
  constexpr std::size_t kCoefficients = 5;
  const bool zero = std::all_of(info.D.begin(), info.D.end(), [](double value) { return value == 0.0; });
  if (zero) return std::nullopt;
  if (info.distortion_model != "plumb_bob") {
    return Error{
        fmt::format("{}: distortion_model is '{}'; only plumb_bob is supported", where, info.distortion_model)};
  }
  if (info.D.size() != kCoefficients && info.D.size() != kCoefficients - 1) {
    return Error{fmt::format("{}: D has {} values; expected k1 k2 p1 p2 k3", where, info.D.size())};
  }
  camera->k1 = info.D[0];
  camera->k2 = info.D[1];
  camera->p1 = info.D[2];
  camera->p2 = info.D[3];
  camera->k3 = info.D.size() == kCoefficients ? info.D[4] : 0.0;
  return std::nullopt;
}

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

// Whether the images are a part or a reduction of the sensor the intrinsics are about.
bool IsCropped(const sensor_msgs::CameraInfo& info) {
  const auto& roi = info.roi;
  const bool whole = (roi.width == 0 && roi.height == 0) || (roi.width == info.width && roi.height == info.height);
  return info.binning_x > 1 || info.binning_y > 1 || roi.x_offset != 0 || roi.y_offset != 0 || !whole;
}

}  // namespace

Rigid3 ToRigid3(const geometry_msgs::Transform& transform) {
  const auto& t = transform.translation;
  const auto& q = transform.rotation;
  return {Eigen::Quaterniond(q.w, q.x, q.y, q.z), Eigen::Vector3d(t.x, t.y, t.z)};
}

OdometryMessageCovariance ToOdometryCovariance(const nav_msgs::Odometry& odometry, const Rigid3& T_child_base) {
  constexpr double kSamePlace = 1e-6;  // m and rad
  const Rigid2 planar = ProjectToPlane(T_child_base);
  if (planar.translation.norm() > kSamePlace || std::abs(planar.angle) > kSamePlace) return {};
  return {PlanarBlock(odometry.pose.covariance), PlanarBlock(odometry.twist.covariance)};
}

PlanarScan ToPlanarScan(const sensor_msgs::LaserScan& scan) {
  PlanarScan planar;
  planar.stamp = ToTimestamp(scan.header.stamp);
  planar.angle_min = static_cast<double>(scan.angle_min);
  planar.angle_increment = static_cast<double>(scan.angle_increment);
  planar.range_min = static_cast<double>(scan.range_min);
  planar.range_max = static_cast<double>(scan.range_max);
  planar.ranges = scan.ranges;
  return planar;
}

Expected<CameraModel> ToCameraModel(const sensor_msgs::CameraInfo& info, const std::string& where, bool rectified) {
  if (IsCropped(info)) return Error{where + ": binning or a region of interest is set; expected the full image"};
  CameraModel camera;
  camera.width = static_cast<int>(info.width);
  camera.height = static_cast<int>(info.height);
  camera.fx = rectified ? info.P[0] : info.K[0];
  camera.cx = rectified ? info.P[2] : info.K[2];
  camera.fy = rectified ? info.P[5] : info.K[4];
  camera.cy = rectified ? info.P[6] : info.K[5];
  if (!rectified) {
    if (const auto error = SetDistortion(info, where, &camera)) return *error;
  }
  const std::vector<std::string> problems = camera.Problems();
  if (!problems.empty()) return Error{fmt::format("{}: {}", where, fmt::join(problems, "; "))};
  return camera;
}

Expected<GrayImage> ToGrayImage(const sensor_msgs::CompressedImage& image) {
  std::optional<GrayImage> gray = DecodeImage(image.data);
  if (gray.has_value()) return std::move(*gray);
  return Error{fmt::format("image of {} bytes, format '{}', not decodable; expected {}", image.data.size(),
                           image.format, kImageFormats)};
}

Expected<GrayImage> ToGrayImage(const sensor_msgs::Image& image) {
  RawImage raw;
  raw.width = static_cast<int>(image.width);
  raw.height = static_cast<int>(image.height);
  raw.row_bytes = image.step;
  raw.encoding = image.encoding;
  raw.big_endian = image.is_bigendian != 0;
  raw.data = &image.data;
  return ConvertImage(raw);
}

StampedImage ReadImage(const rosbag::MessageInstance& message, bool compressed) {
  if (compressed) {
    const auto image = Instantiate<sensor_msgs::CompressedImage>(message);
    return {image->header.stamp, image->header.frame_id, ToGrayImage(*image)};
  }
  const auto image = Instantiate<sensor_msgs::Image>(message);
  return {image->header.stamp, image->header.frame_id, ToGrayImage(*image)};
}

}  // namespace planar_vslam::io
