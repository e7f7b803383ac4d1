#include "planar_vslam/planar/odometry_noise.h"

#include <cmath>

#include "option_problems.h"

namespace planar_vslam {

namespace {

double Square(double value) { return value * value; }

}  // namespace

std::vector<std::string> OdometryNoise::Problems() const {
  std::vector<std::string> problems;
  // A rate may be zero (an error source switched off); a floor may not, or standing still would claim certainty.
  internal::ExpectNotNegative("along_per_sqrt_meter", along_per_sqrt_meter, &problems);
  internal::ExpectNotNegative("across_per_sqrt_meter", across_per_sqrt_meter, &problems);
  internal::ExpectNotNegative("across_per_sqrt_radian", across_per_sqrt_radian, &problems);
  internal::ExpectNotNegative("heading_per_sqrt_meter", heading_per_sqrt_meter, &problems);
  internal::ExpectNotNegative("heading_per_sqrt_radian", heading_per_sqrt_radian, &problems);
  internal::ExpectPositive("position_floor", position_floor, &problems);
  internal::ExpectPositive("heading_floor", heading_floor, &problems);
  internal::ExpectNotNegative("height_per_sqrt_meter", height_per_sqrt_meter, &problems);
  internal::ExpectPositive("height_floor", height_floor, &problems);
  internal::ExpectNotNegative("tilt_per_sqrt_meter", tilt_per_sqrt_meter, &problems);
  internal::ExpectPositive("tilt_floor", tilt_floor, &problems);
  return problems;
}

Eigen::Matrix3d IncrementCovariance(const OdometryNoise& noise, const Rigid2& increment) {
  const double distance = increment.translation.norm();
  const double turn = std::abs(increment.angle);
  const Eigen::Vector3d variances(
      Square(noise.along_per_sqrt_meter) * distance,
      Square(noise.across_per_sqrt_meter) * distance + Square(noise.across_per_sqrt_radian) * turn,
      Square(noise.heading_per_sqrt_meter) * distance + Square(noise.heading_per_sqrt_radian) * turn);
  return variances.asDiagonal();
}

}  // namespace planar_vslam
