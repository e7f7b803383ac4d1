#include "bundle_ceres.h"

#include <ceres/ceres.h>

#include <cmath>
#include <deque>

#include "planar_vslam/geometry/tangent_parts.h"
#include "planar_vslam/optimize/planar_reprojection_factor.h"
#include "planar_vslam/optimize/reprojection_factor.h"
#include "planar_vslam/planar/floor_points.h"
#include "planar_vslam/planar/pose_manifold.h"
#include "planar_vslam/planar/relative_pose_factor.h"

namespace planar_vslam {
namespace {

constexpr std::size_t kDenseSchurPoses = 60;  // beyond, the reduced camera matrix is worth treating as sparse

StageTimes TimesOf(const ceres::Solver::Summary& summary) {
  StageTimes times;
  double other = summary.total_time_in_seconds;
  const auto add = [&](const char* stage, double seconds) {
    times.push_back({stage, 1e3 * seconds});
    other -= seconds;
  };
  add("bundle.preprocess", summary.preprocessor_time_in_seconds);
  add("bundle.residuals", summary.residual_evaluation_time_in_seconds);
  add("bundle.jacobians", summary.jacobian_evaluation_time_in_seconds);
  add("bundle.linear_solver", summary.linear_solver_time_in_seconds);
  add("bundle.other", other);
  return times;
}

class CeresProblem {
 public:
  explicit CeresProblem(const BundleProblem& problem) : p_(problem) {
    blocks_.resize(p_.poses.size() * kPoseBlockSize + p_.points.size() * 3);
    for (std::size_t i = 0; i < p_.poses.size(); ++i) StorePose(p_.poses[i].T_map_base, PoseBlock(i));
    for (std::size_t i = 0; i < p_.points.size(); ++i) Eigen::Map<Eigen::Vector3d>(PointBlock(i)) = p_.points[i].p_map;
    AddBlocks();
    AddReprojections();
    AddMotions();
    for (std::size_t i = 0; i < p_.poses.size(); ++i) {
      if (!p_.has_floor_prior(p_.poses[i])) continue;
      problem_.AddResidualBlock(p_.poses[i].on_floor ? &floor_ : &slope_, nullptr, PoseBlock(i));
    }
    for (const std::size_t i : p_.floor_points) {
      problem_.AddResidualBlock(&floor_point_, &floor_point_loss_, PointBlock(i));
    }
  }

  ceres::Solver::Summary Solve(const BundleLimits& limits) {
    ceres::Solver::Options options;
    options.linear_solver_ordering.reset(ordering_.release());
    options.linear_solver_type = free_poses_ <= kDenseSchurPoses ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
    options.max_num_iterations = limits.max_iterations;
    options.num_threads = 1;
    options.function_tolerance = limits.relative_gain;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    return summary;
  }

  void Store(BundleProblem* problem) const {
    for (std::size_t i = 0; i < p_.poses.size(); ++i) {
      if (p_.poses[i].freedom == PoseFreedom::kFixed) continue;
      problem->poses[i].T_map_base = LoadPose(blocks_.data() + i * kPoseBlockSize);
    }
    const double* points = blocks_.data() + p_.poses.size() * kPoseBlockSize;
    for (std::size_t i = 0; i < p_.points.size(); ++i) {
      problem->points[i].p_map = Eigen::Map<const Eigen::Vector3d>(points + 3 * i);
    }
  }

 private:
  static ceres::Problem::Options Options() {
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }
  double* PoseBlock(std::size_t i) { return blocks_.data() + i * kPoseBlockSize; }
  double* PointBlock(std::size_t i) { return blocks_.data() + p_.poses.size() * kPoseBlockSize + 3 * i; }

  ceres::Manifold* ManifoldOf(PoseFreedom freedom) {
    if (freedom == PoseFreedom::kFloor) return &floor_manifold_;
    if (freedom == PoseFreedom::kLevel) return &level_manifold_;
    return &manifold_;
  }

  void AddBlocks() {
    for (std::size_t i = 0; i < p_.poses.size(); ++i) {
      const PoseFreedom freedom = p_.poses[i].freedom;
      problem_.AddParameterBlock(PoseBlock(i), kPoseBlockSize, ManifoldOf(freedom));
      if (freedom == PoseFreedom::kFixed) problem_.SetParameterBlockConstant(PoseBlock(i));
      free_poses_ += freedom == PoseFreedom::kFixed ? 0 : 1;
      ordering_->AddElementToGroup(PoseBlock(i), 1);
    }
    for (std::size_t i = 0; i < p_.points.size(); ++i) {
      problem_.AddParameterBlock(PointBlock(i), 3);
      ordering_->AddElementToGroup(PointBlock(i), 0);
    }
  }

  void AddReprojections() {
    const CameraModel& c = p_.camera;
    for (std::size_t i = 0; i < p_.observations.size(); ++i) {
      const BundleObservation& o = p_.observations[i];
      if (!o.inlier) continue;
      ceres::CostFunction* factor = &reprojections_.emplace_back(o.pixel, p_.poses[o.pose].T_base_camera, c.fx, c.fy,
                                                                 c.cx, c.cy, 1.0 / o.inverse_sigma);
      if (!p_.whitening.empty()) factor = &inflated_.emplace_back(reprojections_.back(), p_.whitening[i]);
      problem_.AddResidualBlock(factor, &pixel_loss_, PoseBlock(o.pose), PointBlock(o.point));
    }
  }

  void AddMotions() {
    for (const BundleMotion& m : p_.motions) {
      motions_.emplace_back(m.T_i_j, m.sqrt_information(kPlanarRows, Eigen::all));
      problem_.AddResidualBlock(&motions_.back(), &odometry_loss_, PoseBlock(m.i), PoseBlock(m.j));
      motions_.emplace_back(m.T_i_j, m.sqrt_information(kFloorRows, Eigen::all));
      problem_.AddResidualBlock(&motions_.back(), &tilt_loss_, PoseBlock(m.i), PoseBlock(m.j));
    }
  }

  const BundleProblem& p_;
  std::vector<double> blocks_;
  std::size_t free_poses_ = 0;
  std::deque<ReprojectionFactor> reprojections_;  // cost functions cannot be moved
  std::deque<PlanarReprojectionFactor> inflated_;
  std::deque<RelativePoseFactor<3>> motions_;
  PlanarPriorFactor floor_{FloorSigmasOf(p_.planar, true)};
  PlanarPriorFactor slope_{FloorSigmasOf(p_.planar, false)};
  FloorPointFactor floor_point_{p_.planar.sigma_floor_point};
  PoseManifold manifold_;
  FloorPoseManifold floor_manifold_;
  LevelPoseManifold level_manifold_;
  ceres::CauchyLoss floor_point_loss_{kFloorPointLoss};
  ceres::CauchyLoss pixel_loss_{p_.options.pixel_loss};
  ceres::CauchyLoss odometry_loss_{p_.options.odometry_loss};
  ceres::CauchyLoss tilt_loss_{p_.options.tilt_loss};
  std::unique_ptr<ceres::ParameterBlockOrdering> ordering_ = std::make_unique<ceres::ParameterBlockOrdering>();
  ceres::Problem problem_{Options()};
};

}  // namespace

BundleOutcome SolveWithCeres(BundleProblem* problem, const BundleLimits& limits) {
  BundleOutcome outcome;
  StageClock clock(&outcome.times);
  CeresProblem ceres_problem(*problem);
  clock.End("bundle.build");
  const ceres::Solver::Summary summary = ceres_problem.Solve(limits);
  const StageTimes times = TimesOf(summary);
  outcome.times.insert(outcome.times.end(), times.begin(), times.end());
  outcome.usable = summary.IsSolutionUsable();
  outcome.message = summary.message;
  outcome.initial_cost = summary.initial_cost;
  outcome.final_cost = summary.final_cost;
  outcome.iterations = static_cast<int>(summary.iterations.size());
  if (outcome.usable) ceres_problem.Store(problem);
  return outcome;
}

}  // namespace planar_vslam
