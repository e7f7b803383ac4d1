#pragma once
// A Rigid3 as a Ceres parameter block of 7 doubles [tx ty tz qx qy qz qw], with tangent [translation, rotation]:
//   Plus(T, d) = (t + R d_t, q Exp(d_r)).
// Factors compute their Jacobian J_local (rows x 6) with respect to that tangent at d = 0 and write
// J_ambient = J_local * MinusJacobian(x), because PlusJacobian(x) is then a right inverse: MinusJacobian PlusJacobian =
// I.
//
// A pose on the floor is the same block with 3 dof [x, y, yaw] in the axes of the map; height and tilt (the third row
// of R) stay what they are:
//   Plus(T, d) = (t + [d_x, d_y, 0], Rz(d_yaw) q).
// As a tangent of 6 dof this is d_6 = E d with E = [R^T e_x, R^T e_y, 0; 0, 0, R^T e_z]. The columns of E are
// orthonormal, so PlusJacobian = PlusJacobian_6 E and MinusJacobian = E^T MinusJacobian_6.
//
// A pose whose place and direction on the floor are given has the other 3 dof [z, roll, pitch] in the axes of the map:
//   Plus(T, d) = (t + [0, 0, d_z], Exp([d_roll, d_pitch, 0]) q),  E = [R^T e_z, 0, 0; 0, R^T e_x, R^T e_y].
#include <ceres/manifold.h>

#include "planar_vslam/geometry/rigid3.h"

namespace planar_vslam {

constexpr int kPoseBlockSize = 7;
using PoseJacobianMap = Eigen::Matrix<double, 6, 7, Eigen::RowMajor>;

void StorePose(const Rigid3& T, double* block);
Rigid3 LoadPose(const double* block);
// d Minus(y, x) / dy at y = x, 6x7.
PoseJacobianMap PoseMinusJacobian(const double* block);

class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return kPoseBlockSize; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

// Three of the six dof: a manifold whose steps are E d as right perturbations.
class PartialPoseManifold : public ceres::Manifold {
 public:
  int AmbientSize() const final { return kPoseBlockSize; }
  int TangentSize() const final { return 3; }
  bool PlusJacobian(const double* x, double* jacobian) const final;
  bool MinusJacobian(const double* x, double* jacobian) const final;

 private:
  virtual Eigen::Matrix<double, 6, 3> Tangent(const Rigid3& T) const = 0;  // E
};

// E: what a step of 3 dof on the floor is as a right perturbation.
Eigen::Matrix<double, 6, 3> FloorTangent(const Rigid3& T);

class FloorPoseManifold final : public PartialPoseManifold {
 public:
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;

 private:
  Eigen::Matrix<double, 6, 3> Tangent(const Rigid3& T) const override { return FloorTangent(T); }
};

// E of a pose that keeps its place and direction.
Eigen::Matrix<double, 6, 3> LevelTangent(const Rigid3& T);

class LevelPoseManifold final : public PartialPoseManifold {
 public:
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;

 private:
  Eigen::Matrix<double, 6, 3> Tangent(const Rigid3& T) const override { return LevelTangent(T); }
};

}  // namespace planar_vslam
