#include "planar_vslam/optimize/mounted_reprojection_factor.h"

#include "planar_vslam/optimize/reprojection_factor.h"
#include "planar_vslam/planar/pose_manifold.h"

namespace planar_vslam {

Rigid3 Mounted(const Vector6d& mount, const Rigid3& T_base_camera) {
  return {(ExpSo3(mount.tail<3>()) * T_base_camera.rotation).normalized(),
          Eigen::Vector3d(T_base_camera.translation + mount.head<3>())};
}

MountedReprojectionFactor::MountedReprojectionFactor(const Eigen::Vector2d& pixel, const Rigid3& T_base_camera,
                                                     const CameraModel& camera, double sigma)
    : pixel_(pixel),
      R_camera_base_(T_base_camera.R().transpose()),
      t_base_camera_(T_base_camera.translation),
      fx_(camera.fx),
      fy_(camera.fy),
      cx_(camera.cx),
      cy_(camera.cy),
      inverse_sigma_(1.0 / sigma) {}

bool MountedReprojectionFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const Rigid3 T_map_base = LoadPose(parameters[0]);
  const Eigen::Map<const Eigen::Vector3d> p_map(parameters[1]), d(parameters[2]), w(parameters[2] + 3);
  const Eigen::Matrix3d R_base_map = T_map_base.R().transpose();
  const Eigen::Vector3d p_base = R_base_map * (p_map - T_map_base.translation);
  const Eigen::Matrix3d unturn = ExpSo3(w).conjugate().toRotationMatrix();
  const Eigen::Vector3d q = unturn * (p_base - t_base_camera_ - d);
  const Eigen::Vector3d p = R_camera_base_ * q;

  const bool in_front = p.z() > kMinDepth;
  const double inverse_z = in_front ? 1.0 / p.z() : 0.0;
  Eigen::Map<Eigen::Vector2d> residual(residuals);
  residual.setZero();
  if (in_front) {
    residual =
        inverse_sigma_ * (Eigen::Vector2d(fx_ * p.x() * inverse_z + cx_, fy_ * p.y() * inverse_z + cy_) - pixel_);
  }
  if (jacobians == nullptr) return true;

  Eigen::Matrix<double, 2, 3> J_pi;
  J_pi << fx_ * inverse_z, 0.0, -fx_ * p.x() * inverse_z * inverse_z, 0.0, fy_ * inverse_z,
      -fy_ * p.y() * inverse_z * inverse_z;
  const Eigen::Matrix<double, 2, 3> J_camera = inverse_sigma_ * (J_pi * R_camera_base_);
  const Eigen::Matrix<double, 2, 3> J_base = J_camera * unturn;
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
  if (jacobians[2] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> J(jacobians[2]);
    J.leftCols<3>() = -J_base;
    J.rightCols<3>() = J_camera * Skew(q) * RightJacobianSo3(w);
  }
  return true;
}

}  // namespace planar_vslam
