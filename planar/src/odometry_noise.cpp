#include "planar_vslam/planar/odometry_noise.h"

#include <cmath>

namespace planar_vslam {

namespace {

double Square(double value) { return value * value; }

constexpr double kShortestHeadedWay = 0.01;  // m: the direction of a shorter way is noise

Eigen::Matrix3d AmclCovariance(const OdometryNoise& noise, const Rigid2& motion) {
  double trans = motion.translation.norm();
  double rot1 = trans < kShortestHeadedWay ? 0.0 : std::atan2(motion.translation.y(), motion.translation.x());
  if (std::abs(rot1) > M_PI / 2.0) {  // backwards
    rot1 = WrapAngle(rot1 - M_PI);
    trans = -trans;
  }
  const double turn1 = Square(rot1), turn2 = Square(WrapAngle(motion.angle - rot1)), way = Square(trans);
  const Eigen::Vector3d variances(noise.amcl_alpha1 * turn1 + noise.amcl_alpha2 * way,
                                  noise.amcl_alpha3 * way + noise.amcl_alpha4 * (turn1 + turn2),
                                  noise.amcl_alpha1 * turn2 + noise.amcl_alpha2 * way);
  const double c = std::cos(rot1), s = std::sin(rot1);
  Eigen::Matrix3d G;
  G << -trans * s, c, 0.0, trans * c, s, 0.0, 1.0, 0.0, 1.0;
  return G * variances.asDiagonal() * G.transpose();
}

}  // namespace

Eigen::Matrix3d IncrementCovariance(const OdometryNoise& noise, const Rigid2& increment) {
  if (noise.model == OdometryNoiseModel::kAmcl) return AmclCovariance(noise, increment);
  const double distance = increment.translation.norm();
  const double turn = std::abs(increment.angle);
  const Eigen::Vector3d variances(
      Square(noise.along_per_sqrt_meter) * distance,
      Square(noise.across_per_sqrt_meter) * distance + Square(noise.across_per_sqrt_radian) * turn,
      Square(noise.heading_per_sqrt_meter) * distance + Square(noise.heading_per_sqrt_radian) * turn);
  return variances.asDiagonal();
}

}  // namespace planar_vslam
