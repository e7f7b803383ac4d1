#include "planar_vslam/pipeline/blind_drift.h"

namespace planar_vslam {

void BlindDrift::Move(const Rigid2& T_i_j) {
  // By 3 degrees once in 10 m: half as often as in dev_lab and dev_lab_revisit, where it was looked up.
  constexpr double kSlip = DegreesToRadians(3.0);
  constexpr double kApart = 10.0;  // m
  const Eigen::Matrix3d adjoint = AdjointSe2(T_i_j.Inverse());
  by_slips_ = adjoint * by_slips_ * adjoint.transpose();
  by_slips_(2, 2) += kSlip * kSlip * T_i_j.translation.norm() / kApart;
  by_errors_ = adjoint * by_errors_;
  by_errors_.col(0).head<2>() += Eigen::Rotation2Dd(-T_i_j.angle) * T_i_j.translation;
  by_errors_(2, 1) += T_i_j.angle;
}

Eigen::Matrix3d BlindDrift::Covariance() const {
  const Eigen::Matrix<double, 3, 2> root = by_errors_ * sigmas_.asDiagonal();
  return root * root.transpose() + by_slips_;
}

}  // namespace planar_vslam
