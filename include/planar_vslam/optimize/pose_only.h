#pragma once
// Pose of one frame against fixed landmarks: robust Levenberg-Marquardt on 6 unknowns, normal equations accumulated
// point by point, no heap traffic. Four rounds re-classify outliers (chi-square, 2 dof, 95 %); the Huber kernel is
// dropped in the last two.
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
};

struct PoseOnlyProblem {
  Rigid3 T_map_base;  // start
  Rigid3 T_base_camera;
  CameraModel camera;
  std::optional<PosePrior> prior;             // wheel odometry from the previous frame or reference keyframe
  bool planar = false;                        // whether the floor prior takes part
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
