#pragma once
// Rigid motion of the plane. `T_a_b` maps coordinates in b to coordinates in a; chains cancel: T_a_b * T_b_c = T_a_c.
// Tangent vectors are [x, y, angle] (metres, radians) and perturb on the right: T <- T * Exp(xi).
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "planar_vslam/geometry/angles.h"

namespace planar_vslam {

struct Rigid2 {
  Eigen::Vector2d translation = Eigen::Vector2d::Zero();
  double angle = 0.0;  // radians, in (-pi, pi]

  Rigid2() = default;
  Rigid2(const Eigen::Vector2d& t, double a) : translation(t), angle(WrapAngle(a)) {}
  Rigid2(double x, double y, double a) : translation(x, y), angle(WrapAngle(a)) {}

  Eigen::Matrix2d R() const { return Eigen::Rotation2Dd(angle).toRotationMatrix(); }
  Rigid2 Inverse() const {
    const Eigen::Vector2d t = -(Eigen::Rotation2Dd(-angle) * translation);
    return {t, -angle};
  }
};

inline Rigid2 operator*(const Rigid2& T_a_b, const Rigid2& T_b_c) {
  const Eigen::Vector2d t = T_a_b.translation + Eigen::Rotation2Dd(T_a_b.angle) * T_b_c.translation;
  return {t, T_a_b.angle + T_b_c.angle};
}
inline Eigen::Vector2d operator*(const Rigid2& T_a_b, const Eigen::Vector2d& p_b) {
  return T_a_b.translation + Eigen::Rotation2Dd(T_a_b.angle) * p_b;
}

// Constant-twist motion over unit time, and its inverse.
Rigid2 ExpSe2(const Eigen::Vector3d& xi);
Eigen::Vector3d LogSe2(const Rigid2& T);

// Ad with  T Exp(d) = Exp(Ad(T) d) T.
Eigen::Matrix3d AdjointSe2(const Rigid2& T);

// T_a * Exp(fraction * Log(T_a^-1 T_b)), fraction in [0, 1].
Rigid2 Interpolate(const Rigid2& T_a, const Rigid2& T_b, double fraction);

}  // namespace planar_vslam
