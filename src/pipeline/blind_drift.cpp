#include "planar_vslam/pipeline/blind_drift.h"

namespace planar_vslam {

void BlindDrift::Move(const Rigid2& T_i_j) {
  by_errors_ = AdjointSe2(T_i_j.Inverse()) * by_errors_;
  by_errors_.col(0).head<2>() += Eigen::Rotation2Dd(-T_i_j.angle) * T_i_j.translation;
  by_errors_(2, 1) += T_i_j.angle;
}

Eigen::Matrix3d BlindDrift::Covariance() const {
  const Eigen::Matrix<double, 3, 2> root = by_errors_ * sigmas_.asDiagonal();
  return root * root.transpose();
}

}  // namespace planar_vslam
