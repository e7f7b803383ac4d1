#include "planar_vslam/geometry/triangulation.h"

#include <Eigen/LU>
#include <cmath>

namespace planar_vslam {

namespace {

// Rays closer to parallel than this (rad) give depths beyond a million baselines: numerically at infinity.
constexpr double kParallelAngle = 1e-6;

// Two orthonormal rows that span the plane perpendicular to `direction`, so that row * p / |p| is an angle.
Eigen::Matrix<double, 2, 3> PerpendicularRows(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d first = direction.unitOrthogonal();
  Eigen::Matrix<double, 2, 3> rows;
  rows.row(0) = first;
  rows.row(1) = direction.cross(first);
  return rows;
}

// The unit vector x of least |A x|, up to its sign: the axis along which (A^T A)^-1 is longest by far, and the longer
// the more often it is squared. Rows of A are no longer than a few units.
Eigen::Vector4d LeastSingularVector(const Eigen::Matrix4d& A) {
  constexpr double kLeast = 1e-15;  // keeps the inverse finite where the rays meet
  constexpr int kSquarings = 6;     // (A^T A)^-64
  Eigen::Matrix4d normal = A.transpose() * A;
  normal.diagonal().array() += kLeast;
  Eigen::Matrix4d power = normal.inverse();
  for (int i = 0; i < kSquarings; ++i) {
    power /= power.trace();
    power *= power;
  }
  Eigen::Index longest = 0;
  power.diagonal().maxCoeff(&longest);
  return power.col(longest).normalized();
}

}  // namespace

std::optional<Eigen::Vector3d> TriangulateTwoRays(const Eigen::Vector3d& ray_a, const Eigen::Vector3d& ray_b,
                                                  const Rigid3& T_a_b) {
  const double baseline = T_a_b.translation.norm();
  if (!(baseline > 0.0)) return std::nullopt;
  const Eigen::Vector3d direction_a = ray_a.normalized();
  const Eigen::Vector3d direction_b = (T_a_b.rotation * ray_b).normalized();  // in frame a
  if (!(direction_a.cross(direction_b).norm() > kParallelAngle)) return std::nullopt;

  // Both points of view ask the homogeneous point, in units of the baseline, to lie along their ray.
  const Eigen::Vector3d center_b = T_a_b.translation / baseline;
  const Eigen::Matrix<double, 2, 3> rows_b = PerpendicularRows(direction_b);
  Eigen::Matrix4d system;
  system.topLeftCorner<2, 3>() = PerpendicularRows(direction_a);
  system.topRightCorner<2, 1>().setZero();
  system.bottomLeftCorner<2, 3>() = rows_b;
  system.bottomRightCorner<2, 1>() = -rows_b * center_b;

  const Eigen::Vector4d homogeneous = LeastSingularVector(system);
  const Eigen::Vector3d point = homogeneous.head<3>() / homogeneous.w();
  if (!point.allFinite()) return std::nullopt;
  if (point.dot(direction_a) <= 0.0 || (point - center_b).dot(direction_b) <= 0.0) return std::nullopt;
  return Eigen::Vector3d(baseline * point);
}

double ParallaxAngle(const Eigen::Vector3d& point, const Eigen::Vector3d& center_a, const Eigen::Vector3d& center_b) {
  const Eigen::Vector3d from_a = point - center_a;
  const Eigen::Vector3d from_b = point - center_b;
  return std::atan2(from_a.cross(from_b).norm(), from_a.dot(from_b));
}

}  // namespace planar_vslam
