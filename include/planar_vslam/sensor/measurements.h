#pragma once
// Stamped measurements as they enter the house. Stamps are the sensors' header stamps, never arrival times.
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "planar_vslam/geometry/rigid2.h"
#include "planar_vslam/geometry/rigid3.h"
#include "planar_vslam/sensor/timestamp.h"

namespace planar_vslam {

// 8-bit grey image, row-major without padding. The pixels are shared and never written after construction.
struct GrayImage {
  int width = 0;
  int height = 0;
  std::shared_ptr<const std::vector<std::uint8_t>> pixels;  // width * height values

  bool empty() const { return pixels == nullptr || pixels->empty(); }
};

struct ImageFrame {
  Timestamp stamp;
  GrayImage image;
};

// Pose of the base in the odometry frame: continuous, drifting.
struct OdometryReading {
  Timestamp stamp;
  Rigid2 T_odom_base;
  // 1/s: by how much the motion up to here gained in variance, of [x, y, angle] along the axes of the base; where the
  // source says so.
  std::optional<Eigen::Matrix3d> covariance_rate{};
};

// One sweep of a planar laser. Beam i points along angle_min + i * angle_increment in the laser frame.
// A range that is not finite, or at least range_max, means "no return".
struct PlanarScan {
  Timestamp stamp;
  double angle_min = 0.0;        // rad
  double angle_increment = 0.0;  // rad
  double range_min = 0.0;        // m
  double range_max = 0.0;        // m
  std::vector<float> ranges;     // m
};

// An image with where the camera was on the robot at that stamp (the head moves), and a sweep likewise.
struct CameraFrame {
  ImageFrame image;
  Rigid3 T_base_camera;
};
struct LaserFrame {
  PlanarScan scan;
  Rigid3 T_base_laser;
};

}  // namespace planar_vslam
