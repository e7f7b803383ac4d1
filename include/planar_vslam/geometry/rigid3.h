#pragma once
// Rigid motion of space. `T_a_b` maps coordinates in b to coordinates in a; chains cancel: T_a_b * T_b_c = T_a_c.
// Tangent vectors are [translation, rotation] (the ROS covariance order, metres and radians) and perturb on the right.
// Equations: T. Barfoot, State Estimation for Robotics, ch. 7 (reordered where he uses other conventions).
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "planar_vslam/geometry/rigid2.h"

namespace planar_vslam {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

struct Rigid3 {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Rigid3() = default;
  Rigid3(const Eigen::Quaterniond& q, const Eigen::Vector3d& t) : rotation(q), translation(t) {}
  Rigid3(const Eigen::Matrix3d& R, const Eigen::Vector3d& t) : rotation(R), translation(t) {}

  Eigen::Matrix3d R() const { return rotation.toRotationMatrix(); }
  Rigid3 Inverse() const {
    const Eigen::Quaterniond q = rotation.conjugate();
    return {q, Eigen::Vector3d(-(q * translation))};
  }
};

inline Rigid3 operator*(const Rigid3& T_a_b, const Rigid3& T_b_c) {
  return {(T_a_b.rotation * T_b_c.rotation).normalized(),
          Eigen::Vector3d(T_a_b.translation + T_a_b.rotation * T_b_c.translation)};
}
inline Eigen::Vector3d operator*(const Rigid3& T_a_b, const Eigen::Vector3d& p_b) {
  return T_a_b.translation + T_a_b.rotation * p_b;
}

Eigen::Matrix3d Skew(const Eigen::Vector3d& v);

Eigen::Quaterniond ExpSo3(const Eigen::Vector3d& phi);
Eigen::Vector3d LogSo3(const Eigen::Quaterniond& q);  // norm in [0, pi]
// Exp(phi + d) = Exp(phi) Exp(Jr(phi) d) to first order.
Eigen::Matrix3d RightJacobianSo3(const Eigen::Vector3d& phi);
Eigen::Matrix3d RightJacobianInverseSo3(const Eigen::Vector3d& phi);

Rigid3 ExpSe3(const Vector6d& xi);
Vector6d LogSe3(const Rigid3& T);
// T Exp(xi) T^-1 = Exp(Ad(T) xi).
Matrix6d AdjointSe3(const Rigid3& T);
// Log(Exp(xi) Exp(d)) = xi + JrInverse(xi) d to first order.
Matrix6d RightJacobianInverseSe3(const Vector6d& xi);

// T_a * Exp(fraction * Log(T_a^-1 T_b)), fraction in [0, 1].
Rigid3 Interpolate(const Rigid3& T_a, const Rigid3& T_b, double fraction);

// Plane motion as space motion (z = 0, rotation about z), and the nearest plane motion of a space motion:
// x, y of the translation, heading of the rotated x axis.
Rigid3 Embed3(const Rigid2& T);
Rigid2 ProjectToPlane(const Rigid3& T);

}  // namespace planar_vslam
