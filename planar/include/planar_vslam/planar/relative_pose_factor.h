#pragma once
// Wheel odometry between two base poses as a 6-D factor on SE(3) (the paper's Eq. odo-res).
//   e = Log( T~_i_j^-1  T_i_map T_map_j ),  T_i_map = T_map_i^-1,  weighted by S with S^T S = Sigma^-1.
// The paper writes it between camera poses. With T~_{Ci Cj} = T_BC(t_i)^-1 T~_{Bi Bj} T_BC(t_j) that residual is
// Ad(T_BC(t_j)^-1) e, so weighting it by Sigma_C = Ad Sigma Ad^T gives the same cost: the base form needs no adjoint
// and stays right when the camera moves on the robot.
// Jacobians for right perturbations d_i, d_j (T <- T Exp(d)), with Jr^-1 at e:
//   de/dd_j = Jr^-1(e),   de/dd_i = -Jr^-1(e) Ad( (T_map_i^-1 T_map_j)^-1 ).
#include <ceres/ceres.h>

#include "planar_vslam/geometry/rigid3.h"

namespace planar_vslam {

// Unweighted residual and, where not null, its Jacobians with respect to the right perturbations of both poses.
Vector6d RelativePoseResidual(const Rigid3& T_map_i, const Rigid3& T_map_j, const Rigid3& T_i_j_measured, Matrix6d* J_i,
                              Matrix6d* J_j);

// S e for a weight S of Rows rows. Blocks: pose i (7), pose j (7), see pose_manifold.h. Instantiated for 6 rows, the
// whole residual, and for 3, a part of it: wheels measure x, y and yaw, and what height and tilt may do the floor says
// (LiftedCovariance), so Sigma has no terms between the two and S = SquareRootInformation(Sigma) falls into the rows
// kPlanarRows and kFloorRows of tangent_parts.h. As two factors they can have a loss each: a ramp is no slip of the
// wheels.
template <int Rows>
class RelativePoseFactor final : public ceres::SizedCostFunction<Rows, 7, 7> {
 public:
  using Weight = Eigen::Matrix<double, Rows, 6>;
  RelativePoseFactor(const Rigid3& T_i_j_measured, const Weight& sqrt_information)
      : T_i_j_(T_i_j_measured), sqrt_information_(sqrt_information) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Rigid3 T_i_j_;
  Weight sqrt_information_;
};

extern template class RelativePoseFactor<3>;
extern template class RelativePoseFactor<6>;

}  // namespace planar_vslam
