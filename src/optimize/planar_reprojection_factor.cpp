#include "planar_vslam/optimize/planar_reprojection_factor.h"

#include <cmath>

#include "planar_vslam/planar/pose_manifold.h"

namespace planar_vslam {

Eigen::Matrix<double, 2, 3> FloorErrorJacobian(const Eigen::Matrix<double, 2, 3>& J_point,
                                               const Eigen::Vector3d& point_from_base) {
  Eigen::Matrix<double, 2, 3> J;
  J.col(0) = -J_point.col(2);
  J.rightCols<2>().noalias() = J_point * Skew(point_from_base).leftCols<2>();
  return J;
}

Eigen::Matrix2d FloorWhitening(const Eigen::Matrix<double, 2, 3>& floor_jacobian, double sigma_height,
                               double sigma_tilt) {
  const Eigen::Matrix<double, 2, 3> J =
      floor_jacobian * Eigen::Vector3d(sigma_height, sigma_tilt, sigma_tilt).asDiagonal();
  const Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity() + J * J.transpose();
  // Cholesky and its inverse, written out for 2x2.
  const double l11 = std::sqrt(covariance(0, 0));
  const double l21 = covariance(1, 0) / l11;
  const double l22 = std::sqrt(covariance(1, 1) - l21 * l21);
  Eigen::Matrix2d W;
  W << 1.0 / l11, 0.0, -l21 / (l11 * l22), 1.0 / l22;
  return W;
}

Eigen::Matrix2d FloorWhitening(const ReprojectionFactor& reprojection, const double* pose, const double* point,
                               double sigma_height, double sigma_tilt) {
  Eigen::Vector2d e;
  Eigen::Matrix<double, 2, 3, Eigen::RowMajor> J_point;
  const double* parameters[] = {pose, point};
  double* jacobians[] = {nullptr, J_point.data()};
  reprojection.Evaluate(parameters, e.data(), jacobians);
  const Eigen::Vector3d point_from_base =
      Eigen::Map<const Eigen::Vector3d>(point) - Eigen::Map<const Eigen::Vector3d>(pose);
  return FloorWhitening(FloorErrorJacobian(J_point, point_from_base), sigma_height, sigma_tilt);
}

bool PlanarReprojectionFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  if (!reprojection_.Evaluate(parameters, residuals, jacobians)) return false;
  Eigen::Map<Eigen::Vector2d> e(residuals);
  e = (whitening_ * e).eval();
  if (jacobians == nullptr) return true;
  if (jacobians[0] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, kPoseBlockSize, Eigen::RowMajor>> J(jacobians[0]);
    J = (whitening_ * J).eval();
  }
  if (jacobians[1] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> J(jacobians[1]);
    J = (whitening_ * J).eval();
  }
  return true;
}

}  // namespace planar_vslam
