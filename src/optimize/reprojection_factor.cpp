#include "planar_vslam/optimize/reprojection_factor.h"

#include "planar_vslam/planar/pose_manifold.h"

namespace planar_vslam {

ReprojectionFactor::ReprojectionFactor(const Eigen::Vector2d& pixel, const Rigid3& T_base_camera, double fx, double fy,
                                       double cx, double cy, double sigma)
    : pixel_(pixel),
      R_camera_base_(T_base_camera.R().transpose()),
      t_camera_base_(-(R_camera_base_ * T_base_camera.translation)),
      fx_(fx),
      fy_(fy),
      cx_(cx),
      cy_(cy),
      inverse_sigma_(1.0 / sigma) {}

bool ReprojectionFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const Rigid3 T_map_base = LoadPose(parameters[0]);
  const Eigen::Map<const Eigen::Vector3d> p_map(parameters[1]);
  const Eigen::Matrix3d R_base_map = T_map_base.R().transpose();
  const Eigen::Vector3d p_base = R_base_map * (p_map - T_map_base.translation);
  const Eigen::Vector3d p = R_camera_base_ * p_base + t_camera_base_;

  const bool in_front = p.z() > kMinDepth;
  const double inverse_z = in_front ? 1.0 / p.z() : 0.0;
  Eigen::Map<Eigen::Vector2d> residual(residuals);
  if (in_front) {
    residual =
        inverse_sigma_ * (Eigen::Vector2d(fx_ * p.x() * inverse_z + cx_, fy_ * p.y() * inverse_z + cy_) - pixel_);
  } else {
    residual.setZero();
  }
  if (jacobians == nullptr) return true;

  Eigen::Matrix<double, 2, 3> J_pi;
  J_pi << fx_ * inverse_z, 0.0, -fx_ * p.x() * inverse_z * inverse_z, 0.0, fy_ * inverse_z,
      -fy_ * p.y() * inverse_z * inverse_z;
  const Eigen::Matrix<double, 2, 3> J_base = inverse_sigma_ * (J_pi * R_camera_base_);
  if (jacobians[0] != nullptr) {
    Eigen::Matrix<double, 2, 6> J_local;
    J_local.leftCols<3>() = -J_base;
    J_local.rightCols<3>() = J_base * Skew(p_base);
    Eigen::Map<Eigen::Matrix<double, 2, 7, Eigen::RowMajor>> J(jacobians[0]);
    J = J_local * PoseMinusJacobian(parameters[0]);
  }
  if (jacobians[1] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> J(jacobians[1]);
    J = J_base * R_base_map;
  }
  return true;
}

}  // namespace planar_vslam
