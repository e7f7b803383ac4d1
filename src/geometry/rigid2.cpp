#include "planar_vslam/geometry/rigid2.h"

#include <cmath>

namespace planar_vslam {

namespace {

// Below this angle (rad) the two-term series is exact to double precision.
constexpr double kSeriesAngle = 1e-4;

// (angle / 2) / tan(angle / 2), even and smooth on (-2 pi, 2 pi).
double HalfAngleCotangent(double angle) {
  if (std::abs(angle) < kSeriesAngle) return 1.0 - angle * angle / 12.0;
  const double half = 0.5 * angle;
  return half * std::cos(half) / std::sin(half);
}

}  // namespace

Rigid2 ExpSe2(const Eigen::Vector3d& xi) {
  const double angle = xi.z();
  const bool small = std::abs(angle) < kSeriesAngle;
  const double half_sine = std::sin(0.5 * angle);
  const double a = small ? 1.0 - angle * angle / 6.0 : std::sin(angle) / angle;
  const double b = small ? 0.5 * angle : 2.0 * half_sine * half_sine / angle;  // (1 - cos) / angle, no cancellation
  return {a * xi.x() - b * xi.y(), b * xi.x() + a * xi.y(), angle};
}

Eigen::Vector3d LogSe2(const Rigid2& T) {
  const double a = HalfAngleCotangent(T.angle);
  const double b = 0.5 * T.angle;
  const Eigen::Vector2d& t = T.translation;
  return {a * t.x() + b * t.y(), a * t.y() - b * t.x(), T.angle};
}

Rigid2 Interpolate(const Rigid2& T_a, const Rigid2& T_b, double fraction) {
  return T_a * ExpSe2(fraction * LogSe2(T_a.Inverse() * T_b));
}

Eigen::Matrix3d AdjointSe2(const Rigid2& T) {
  Eigen::Matrix3d adjoint = Eigen::Matrix3d::Identity();
  adjoint.topLeftCorner<2, 2>() = T.R();
  adjoint(0, 2) = T.translation.y();
  adjoint(1, 2) = -T.translation.x();
  return adjoint;
}

}  // namespace planar_vslam
