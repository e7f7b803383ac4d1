#include "planar_vslam/planar/relative_pose_factor.h"

#include "planar_vslam/planar/pose_manifold.h"

namespace planar_vslam {

Vector6d RelativePoseResidual(const Rigid3& T_map_i, const Rigid3& T_map_j, const Rigid3& T_i_j_measured, Matrix6d* J_i,
                              Matrix6d* J_j) {
  const Rigid3 T_i_j = T_map_i.Inverse() * T_map_j;
  const Vector6d e = LogSe3(T_i_j_measured.Inverse() * T_i_j);
  if (J_i == nullptr && J_j == nullptr) return e;

  const Matrix6d Jr_inverse = RightJacobianInverseSe3(e);
  if (J_j != nullptr) *J_j = Jr_inverse;
  // T_map_i Exp(d) turns T_i_j into Exp(-d) T_i_j = T_i_j Exp(-Ad(T_i_j^-1) d).
  if (J_i != nullptr) J_i->noalias() = -Jr_inverse * AdjointSe3(T_i_j.Inverse());
  return e;
}

template <int Rows>
bool RelativePoseFactor<Rows>::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const Rigid3 T_map_i = LoadPose(parameters[0]);
  const Rigid3 T_map_j = LoadPose(parameters[1]);
  double* out_i = jacobians != nullptr ? jacobians[0] : nullptr;
  double* out_j = jacobians != nullptr ? jacobians[1] : nullptr;

  Matrix6d J_i, J_j;
  const Vector6d e = RelativePoseResidual(T_map_i, T_map_j, T_i_j_, out_i != nullptr ? &J_i : nullptr,
                                          out_j != nullptr ? &J_j : nullptr);
  Eigen::Map<Eigen::Matrix<double, Rows, 1>>(residuals).noalias() = sqrt_information_ * e;
  using JacobianMap = Eigen::Map<Eigen::Matrix<double, Rows, kPoseBlockSize, Eigen::RowMajor>>;
  if (out_i != nullptr) {
    const Weight weighted = sqrt_information_ * J_i;
    JacobianMap(out_i).noalias() = weighted * PoseMinusJacobian(parameters[0]);
  }
  if (out_j != nullptr) {
    const Weight weighted = sqrt_information_ * J_j;
    JacobianMap(out_j).noalias() = weighted * PoseMinusJacobian(parameters[1]);
  }
  return true;
}

template class RelativePoseFactor<3>;
template class RelativePoseFactor<6>;

}  // namespace planar_vslam
