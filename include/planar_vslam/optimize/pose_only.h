#pragma once
// Pose of one frame against fixed landmarks: robust Levenberg-Marquardt on 6 unknowns, normal equations accumulated
// point by point in the camera's axes, no heap traffic but for the weights of se2_xyz. Up to four rounds re-classify
// outliers (chi-square, 2 dof, 95 %); the Huber kernel is dropped in the last two. But for se2_xyz, a round that
// changes no class is the last one: all errors that took part are below where the kernel begins, and the problem of the
// next round has the same minimum.
//
// With `floor` se2_xyz or hard the pose is put on the floor and has 3 unknowns, steps E d (pose_manifold.h). With
// se2_xyz each error is weighted by the W of planar_reprojection_factor.h, computed anew in every round. The prior then
// enters with its marginal of x, y and yaw.
//
// Covariance of that pose. Its normal matrix H = sum J^T W^T W J + S^T S (J by the 3 unknowns, S the prior's weight) is
// none: it takes the image's one height and tilt f for a new draw at each point, or, if hard, for zero. With F = [J_z,
// J_theta] of a point and Sigma_f = diag(sigma_height^2, sigma_tilt^2, sigma_tilt^2), the estimate is off the truth by
//   d = H^-1 (B f - sum J^T W^T W n - S^T s),  B = sum J^T W^T W F,  n ~ I (pixels),  s ~ I (prior),  f ~ Sigma_f
// to first order, hence
//   Cov(d) = H^-1 (B Sigma_f B^T + sum J^T (W^T W)^2 J + S^T S) H^-1,   Cov(d, f) = H^-1 B Sigma_f
// and, the pose on the floor lacking f, the covariance of all 6 is
//   [E, G] [Cov(d), -Cov(d, f); ., Sigma_f] [E, G]^T,   G = [R^T e_z, 0, 0; 0, R^T e_x, R^T e_y]
// `information` is its inverse; with soft_se3 or without a floor it is the normal matrix of the 6 unknowns.
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "planar_vslam/geometry/rigid3.h"
#include "planar_vslam/planar/planar_prior.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam {

struct PoseObservation {
  Eigen::Vector3d p_map;
  Eigen::Vector2d pixel;  // undistorted
  double sigma = 1.0;     // px
  bool inlier = true;     // in: initial belief; out: final class
};

// A predicted pose with covariance (tangent of a right perturbation at the prediction).
struct PosePrior {
  Rigid3 T_map_base;
  Matrix6d sqrt_information;
  bool planar = false;  // only its marginal of x, y and yaw takes part, height and tilt are free
};

struct PoseOnlyProblem {
  Rigid3 T_map_base;  // start
  Rigid3 T_base_camera;
  CameraModel camera;
  std::optional<PosePrior> prior;             // wheel odometry from the previous frame or reference keyframe
  PlanarMode floor = PlanarMode::kOff;        // how the floor takes part
  double sigma_height = 0.01;                 // m
  double sigma_tilt = DegreesToRadians(0.5);  // rad
};

struct PoseOnlyResult {
  Rigid3 T_map_base;
  Matrix6d information = Matrix6d::Zero();  // of the right perturbation at the solution
  int inliers = 0;
  double mean_square_error = 0.0;  // of the inliers, normalised by sigma, 2 dof each
};

PoseOnlyResult OptimizePose(const PoseOnlyProblem& problem, std::vector<PoseObservation>* observations);

}  // namespace planar_vslam
