#pragma once
// How uncertain a wheel-odometry increment is. Rate-independent: variances grow with distance and turn, not with the
// number of readings (estimation: a random walk in arc length). For an increment of length d (m) and turn dphi (rad):
//   sigma_x^2   = along_per_sqrt_meter^2  d + q_x
//   sigma_y^2   = across_per_sqrt_meter^2 d + across_per_sqrt_radian^2 |dphi| + q_y
//   sigma_phi^2 = heading_per_sqrt_meter^2 d + heading_per_sqrt_radian^2 |dphi| + q_phi
// The floors q are per preintegrated interval, not per reading, so that standing still never claims certainty.
#include <Eigen/Core>
#include <string>
#include <vector>

#include "planar_vslam/geometry/rigid2.h"

namespace planar_vslam {

struct OdometryNoise {
  double along_per_sqrt_meter = 0.02;                      // m / sqrt(m)
  double across_per_sqrt_meter = 0.02;                     // m / sqrt(m); an omnidirectional base slips both ways
  double across_per_sqrt_radian = 0.005;                   // m / sqrt(rad)
  double heading_per_sqrt_meter = DegreesToRadians(0.35);  // rad / sqrt(m)
  double heading_per_sqrt_radian = 0.015;                  // rad / sqrt(rad)
  double position_floor = 0.002;                           // m, q_x = q_y = position_floor^2
  double heading_floor = DegreesToRadians(0.1);            // rad, q_phi
  // What the floor lets the base do between two poses in the directions odometry does not measure.
  double height_per_sqrt_meter = 0.005;                // m / sqrt(m)
  double height_floor = 0.005;                         // m
  double tilt_per_sqrt_meter = DegreesToRadians(0.2);  // rad / sqrt(m), roll and pitch each
  double tilt_floor = DegreesToRadians(0.3);           // rad: sway and joint backlash

  std::vector<std::string> Problems() const;
};

// Covariance of one increment expressed in its starting frame, tangent [x, y, angle], without the floors.
Eigen::Matrix3d IncrementCovariance(const OdometryNoise& noise, const Rigid2& increment);

}  // namespace planar_vslam
