#pragma once
// A landmark seen from a base that is held on the floor, though it sways and the floor is uneven: SE(2)-XYZ (Zheng and
// Liu, Visual-Odometric Localization and Mapping for Ground Vehicles Using SE(2)-XYZ Constraints, ICRA 2019).
// The true pose is the floor pose (R, p) moved by what the floor does not tell,
//   R <- Exp([eta_x, eta_y, 0]) R,  p <- p + [0, 0, eta_z],   eta_x, eta_y ~ sigma_tilt,  eta_z ~ sigma_height.
// With e the reprojection error in units of its pixel sigma (reprojection_factor.h) and J_l = de/dl its derivative by
// the point, p_base = R^T (l - p) gives, since R^T Exp(-eta) v = R^T (v + [v]x eta) for v = l - p to first order,
//   de/deta_xy = J_theta = (J_l [l - p]x)(:, 1:2),    de/deta_z = J_z = -J_l(:, 3)
//   Sigma_e = I + sigma_tilt^2 J_theta J_theta^T + sigma_height^2 J_z J_z^T = L L^T
// and the factor is  e' = W e,  W = L^-1  (2x2, lower triangular). W is a constant of the factor: were it to follow
// the state, the solver could lower the cost by enlarging Sigma. It is computed anew between rounds.
//
// Jacobians: W times those of the reprojection. With the 3-dof manifold of pose_manifold.h they become, in map axes,
//   de'/d[x, y] = -W J_l(:, 1:2),   de'/dyaw = W (J_l [l - p]x)(:, 3),   de'/dl = W J_l.
//
// Trap: height and tilt are one draw per image, but enter here as independent of point to point, so that a thousand
// points seem to average them out. The Hessian of these factors is no covariance of the pose; pose_only.h says what is.
#include <ceres/ceres.h>

#include "planar_vslam/optimize/reprojection_factor.h"

namespace planar_vslam {

// J_l = de/dl (2x3, over the pixel sigma) and l - p in the map -> [J_z, J_theta] (2x3): by height (m) and tilt (rad).
Eigen::Matrix<double, 2, 3> FloorErrorJacobian(const Eigen::Matrix<double, 2, 3>& J_point,
                                               const Eigen::Vector3d& point_from_base);

// W of the header. The identity where the Jacobian is zero.
Eigen::Matrix2d FloorWhitening(const Eigen::Matrix<double, 2, 3>& floor_jacobian, double sigma_height,
                               double sigma_tilt);

// W for a factor as it stands with these blocks.
Eigen::Matrix2d FloorWhitening(const ReprojectionFactor& reprojection, const double* pose, const double* point,
                               double sigma_height, double sigma_tilt);

// Blocks: pose (7), point (3). `reprojection` must outlive the factor.
class PlanarReprojectionFactor final : public ceres::SizedCostFunction<2, 7, 3> {
 public:
  PlanarReprojectionFactor(const ReprojectionFactor& reprojection, const Eigen::Matrix2d& whitening)
      : reprojection_(reprojection), whitening_(whitening) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  const ReprojectionFactor& reprojection_;
  Eigen::Matrix2d whitening_;
};

}  // namespace planar_vslam
