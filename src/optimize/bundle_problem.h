#pragma once
// The part of a map that takes part in a bundle adjustment, copied into flat arrays in id order: what both of its
// solvers work on (schur_solver.h, bundle_ceres.h), so that they minimise the same cost.
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "planar_vslam/geometry/chi_square.h"
#include "planar_vslam/optimize/bundle_adjustment.h"

namespace planar_vslam {

enum class PoseFreedom : std::uint8_t {
  kFixed,
  kFloor,  // x, y and yaw: a form of the floor with planar poses
  kLevel,  // z, roll and pitch: the map's origin, where a prior knows the floor but nothing else may move
  kFree,   // all six
};

struct BundlePose {
  KeyframeId id;
  Rigid3 T_map_base;
  Rigid3 T_base_camera;
  PoseFreedom freedom = PoseFreedom::kFixed;
  bool on_floor = false;  // the floor's form (planar_prior.h) is about this pose at all
};

struct BundlePoint {
  LandmarkId id;
  Eigen::Vector3d p_map;
};

struct BundleObservation {
  std::uint32_t pose;   // index
  std::uint32_t point;  // index
  Eigen::Vector2d pixel;
  double inverse_sigma;  // 1/px
  bool inlier = true;
};

// Of wheels or laser: relative_pose_factor.h, its planar rows and its floor rows with a loss each.
struct BundleMotion {
  std::size_t i, j;  // poses, i before j
  Rigid3 T_i_j;
  Matrix6d sqrt_information;
};

struct BundleProblem {
  CameraModel camera;
  PlanarPriorOptions planar;
  BundleOptions options;
  bool metric = false;                          // else neither floor nor slopes mean anything
  std::vector<BundlePose> poses;                // ascending by id
  std::vector<BundlePoint> points;              // ascending by id
  std::vector<BundleObservation> observations;  // ascending by point, then by pose
  std::vector<BundleMotion> motions;            // at least one pose is not fixed
  std::vector<std::size_t> floor_points;        // indices of points on the floor (floor_points.h)
  std::vector<Eigen::Matrix2d> whitening;       // W of planar_reprojection_factor.h per observation, or empty

  bool has_floor_prior(const BundlePose& pose) const {
    if (!metric || pose.freedom == PoseFreedom::kFixed) return false;
    return pose.on_floor ? planar.mode == PlanarMode::kSoftSe3 : planar.mode != PlanarMode::kOff;
  }
  FloorSigmas floor_sigmas(const BundlePose& pose) const { return FloorSigmasOf(planar, pose.on_floor); }
};

// Poses that have three degrees of freedom are put on the floor here.
BundleProblem MakeBundleProblem(const Map& map, const BundleRequest& request, const MeasurementModel& model);

// What turns points of the map into points of a camera.
struct CameraPose {
  Eigen::Matrix3d R;  // camera <- map
  Eigen::Vector3d t;
};
std::vector<CameraPose> CameraPoses(const BundleProblem& problem);  // of the poses, as they are

// With se2_xyz: the weights of pixels at the present state. They are constants while a solver runs.
void RefreshWhitening(BundleProblem* problem);

// Marks observations beyond the 95 % limit or behind the camera. Returns how many changed.
std::size_t Classify(BundleProblem* problem);

// When a solver ends.
struct BundleLimits {
  int max_iterations = 5;
  double relative_gain = 1e-5;               // of the cost by one step, below which the work ends
  const std::atomic<bool>* hurry = nullptr;  // once it is set, the step at work is the last
};

// How a solver left the problem: at the least cost it found.
struct BundleOutcome {
  bool usable = false;                          // finite, and no worse than at the start
  std::string message;                          // why not, or what ended the iterations
  double initial_cost = 0.0, final_cost = 0.0;  // half the sum of squares, each through its loss
  int iterations = 0;                           // the first evaluation counts
  StageTimes times;                             // "bundle.residuals", ... (bundle_adjustment.h)
};

inline constexpr double kFloorPointLoss = 2.0;  // sigmas, Cauchy

}  // namespace planar_vslam
