#include "planar_vslam/planar/planar_prior.h"

#include "planar_vslam/planar/pose_manifold.h"

namespace planar_vslam {

Eigen::Vector3d PlanarPriorResidual(const Rigid3& T_map_base, const FloorSigmas& sigmas,
                                    Eigen::Matrix<double, 3, 6>* J) {
  const Eigen::Vector3d u = T_map_base.R().row(2).transpose();  // R^T e_z
  if (J != nullptr) {
    J->setZero();
    J->block<1, 3>(0, 0) = u.transpose() / sigmas.height;
    J->block<2, 3>(1, 3) = Skew(u).topRows<2>() / sigmas.tilt;
  }
  return {T_map_base.translation.z() / sigmas.height, u.x() / sigmas.tilt, u.y() / sigmas.tilt};
}

bool PlanarPriorFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  double* out = jacobians != nullptr ? jacobians[0] : nullptr;
  Eigen::Matrix<double, 3, 6> J;
  Eigen::Map<Eigen::Vector3d>{residuals} =
      PlanarPriorResidual(LoadPose(parameters[0]), sigmas_, out != nullptr ? &J : nullptr);
  if (out != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 3, 7, Eigen::RowMajor>> ambient(out);
    ambient.noalias() = J * PoseMinusJacobian(parameters[0]);
  }
  return true;
}

}  // namespace planar_vslam
