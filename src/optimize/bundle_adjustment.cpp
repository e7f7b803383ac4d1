#include "planar_vslam/optimize/bundle_adjustment.h"

#include <ceres/ceres.h>

#include <algorithm>
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

constexpr double kChi2TwoDof95 = 5.991;       // chi-square, 2 dof, 95 %
constexpr std::size_t kDenseSchurPoses = 60;  // beyond, the reduced camera matrix is worth treating as sparse

void AddTimes(const ceres::Solver::Summary& summary, StageTimes* times) {
  double other = summary.total_time_in_seconds;
  const auto add = [&](const char* stage, double seconds) {
    times->push_back({stage, 1e3 * seconds});
    other -= seconds;
  };
  add("bundle.preprocess", summary.preprocessor_time_in_seconds);
  add("bundle.residuals", summary.residual_evaluation_time_in_seconds);
  add("bundle.jacobians", summary.jacobian_evaluation_time_in_seconds);
  add("bundle.linear_solver", summary.linear_solver_time_in_seconds);
  add("bundle.other", other);
}

struct BlockObservation {
  std::size_t keyframe;  // index into the keyframe blocks
  std::size_t landmark;  // index into the landmark blocks
  bool inlier = true;
};

// The part of a map that takes part, copied into parameter blocks that lie in id order in one buffer: Ceres then gives
// the same bits in every run.
class BundleProblem {
 public:
  BundleProblem(const Map& map, const BundleRequest& request, const MeasurementModel& context)
      : map_(map), request_(request), context_(context) {
    std::merge(request.free_keyframes.begin(), request.free_keyframes.end(), request.fixed_keyframes.begin(),
               request.fixed_keyframes.end(), std::back_inserter(keyframes_));
    blocks_.resize(keyframes_.size() * kPoseBlockSize + request.landmarks.size() * 3);
    for (std::size_t i = 0; i < keyframes_.size(); ++i) {
      const Rigid3& T_map_base = map.keyframes.At(keyframes_[i]).T_map_base;
      StorePose(HasPlanarPose(keyframes_[i]) ? Embed3(ProjectToPlane(T_map_base)) : T_map_base, PoseBlock(i));
    }
    for (std::size_t i = 0; i < request.landmarks.size(); ++i) {
      const Landmark& landmark = map.landmarks.At(request.landmarks[i]);
      Eigen::Map<Eigen::Vector3d>(PointBlock(i)) = landmark.p_map;
      for (const Observation& o : landmark.observations) CollectObservation(i, o);
    }
    if (context.planar.floor_points && context.planar.mode != PlanarMode::kOff && map.metric) FindFloor();
  }

  std::size_t observation_count() const { return observations_.size(); }

  bool Solve(int max_iterations, BundleResult* result) {
    const Stopwatch build;
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ceres::Problem problem(options);
    auto* ordering = new ceres::ParameterBlockOrdering;
    AddBlocks(&problem, ordering);
    AddReprojections(&problem);
    AddMotions(&problem);
    AddFloor(&problem);
    AddFloorPoints(&problem);

    ceres::Solver::Options solver;
    solver.linear_solver_ordering.reset(ordering);
    solver.linear_solver_type =
        request_.free_keyframes.size() <= kDenseSchurPoses ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
    solver.max_num_iterations = max_iterations;
    solver.num_threads = 1;
    solver.function_tolerance = 1e-5;
    solver.logging_type = ceres::SILENT;
    result->times.push_back({"bundle.build", build.Milliseconds()});
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);
    AddTimes(summary, &result->times);
    if (result->iterations == 0) result->initial_cost = summary.initial_cost;
    result->final_cost = summary.final_cost;
    result->iterations += static_cast<int>(summary.iterations.size());
    result->message = summary.message;
    return summary.IsSolutionUsable();
  }

  // Marks observations beyond the chi-square limit or behind the camera.
  void Classify() {
    for (std::size_t i = 0; i < observations_.size(); ++i) {
      BlockObservation& o = observations_[i];
      const double* pose = PoseBlock(o.keyframe);
      const Keyframe& keyframe = map_.keyframes.At(keyframes_[o.keyframe]);
      const Rigid3 T_map_camera = LoadPose(pose) * keyframe.T_base_camera;
      const Eigen::Vector3d p_camera =
          T_map_camera.Inverse() * Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(PointBlock(o.landmark)));
      const Keypoint& keypoint = KeypointOf(o);
      o.inlier = p_camera.z() > kMinDepth;
      if (!o.inlier) continue;
      Eigen::Vector2d e =
          (context_.camera.ProjectUndistorted(p_camera) - keypoint.pixel.cast<double>()) / Sigma(keypoint);
      if (IsInflated(o)) e = (WhiteningOf(i) * e).eval();
      o.inlier = e.squaredNorm() <= kChi2TwoDof95;
    }
  }

  void Report(BundleResult* result) const {
    for (std::size_t i = 0; i < keyframes_.size(); ++i) {
      if (IsFree(keyframes_[i])) result->poses.emplace_back(keyframes_[i], LoadPose(PoseBlock(i)));
    }
    for (std::size_t i = 0; i < request_.landmarks.size(); ++i) {
      result->points.emplace_back(request_.landmarks[i], Eigen::Map<const Eigen::Vector3d>(PointBlock(i)));
    }
    for (const BlockObservation& o : observations_) {
      if (!o.inlier) result->outliers.emplace_back(request_.landmarks[o.landmark], keyframes_[o.keyframe]);
    }
  }

 private:
  double* PoseBlock(std::size_t i) { return blocks_.data() + i * kPoseBlockSize; }
  const double* PoseBlock(std::size_t i) const { return blocks_.data() + i * kPoseBlockSize; }
  double* PointBlock(std::size_t i) { return blocks_.data() + keyframes_.size() * kPoseBlockSize + 3 * i; }
  const double* PointBlock(std::size_t i) const { return blocks_.data() + keyframes_.size() * kPoseBlockSize + 3 * i; }

  bool IsFree(KeyframeId id) const {
    return std::binary_search(request_.free_keyframes.begin(), request_.free_keyframes.end(), id);
  }
  std::size_t IndexOf(KeyframeId id) const {
    const auto it = std::lower_bound(keyframes_.begin(), keyframes_.end(), id);
    return it != keyframes_.end() && *it == id ? static_cast<std::size_t>(it - keyframes_.begin()) : keyframes_.size();
  }
  // Whether the floor's form (planar_prior.h) is about this keyframe at all.
  bool IsOnFloor(KeyframeId id) const { return map_.metric && map_.keyframes.At(id).on_floor; }
  bool HasPlanarPose(KeyframeId id) const { return IsPlanar(context_.planar.mode) && IsFree(id) && IsOnFloor(id); }
  bool IsInflated(const BlockObservation& o) const {
    return context_.planar.mode == PlanarMode::kSe2Xyz && IsOnFloor(keyframes_[o.keyframe]);
  }
  Eigen::Matrix2d WhiteningOf(std::size_t i) const {
    const BlockObservation& o = observations_[i];
    return FloorWhitening(reprojections_[i], PoseBlock(o.keyframe), PointBlock(o.landmark),
                          context_.planar.sigma_height, context_.planar.sigma_tilt);
  }
  const Keypoint& KeypointOf(const BlockObservation& o) const {
    const Landmark& landmark = map_.landmarks.At(request_.landmarks[o.landmark]);
    const KeyframeId id = keyframes_[o.keyframe];
    const auto it = std::lower_bound(landmark.observations.begin(), landmark.observations.end(), id,
                                     [](const Observation& a, KeyframeId k) { return a.keyframe < k; });
    return map_.keyframes.At(id).features->keypoints[it->keypoint];
  }
  double Sigma(const Keypoint& keypoint) const {
    return context_.pixel_sigma * map_.octave_scales[static_cast<std::size_t>(keypoint.octave)];
  }

  void CollectObservation(std::size_t landmark, const Observation& o) {
    const std::size_t index = IndexOf(o.keyframe);
    if (index == keyframes_.size()) return;
    const Keyframe& keyframe = map_.keyframes.At(o.keyframe);
    const Keypoint& keypoint = keyframe.features->keypoints[o.keypoint];
    observations_.push_back({index, landmark, true});
    reprojections_.emplace_back(keypoint.pixel.cast<double>(), keyframe.T_base_camera, context_.camera.fx,
                                context_.camera.fy, context_.camera.cx, context_.camera.cy, Sigma(keypoint));
  }

  void AddBlocks(ceres::Problem* problem, ceres::ParameterBlockOrdering* ordering) {
    for (std::size_t i = 0; i < keyframes_.size(); ++i) {
      const bool planar = HasPlanarPose(keyframes_[i]);
      problem->AddParameterBlock(PoseBlock(i), kPoseBlockSize,
                                 planar ? static_cast<ceres::Manifold*>(&floor_manifold_) : &manifold_);
      if (!IsFree(keyframes_[i])) problem->SetParameterBlockConstant(PoseBlock(i));
      ordering->AddElementToGroup(PoseBlock(i), 1);
    }
    for (std::size_t i = 0; i < request_.landmarks.size(); ++i) {
      problem->AddParameterBlock(PointBlock(i), 3);
      ordering->AddElementToGroup(PointBlock(i), 0);
    }
  }

  void AddReprojections(ceres::Problem* problem) {
    inflated_.clear();  // their weights are those of the present state
    for (std::size_t i = 0; i < observations_.size(); ++i) {
      const BlockObservation& o = observations_[i];
      if (!o.inlier) continue;
      ceres::CostFunction* factor = &reprojections_[i];
      if (IsInflated(o)) factor = &inflated_.emplace_back(reprojections_[i], WhiteningOf(i));
      problem->AddResidualBlock(factor, &pixel_loss_, PoseBlock(o.keyframe), PointBlock(o.landmark));
    }
  }

  void AddMotions(ceres::Problem* problem) {
    if (!map_.metric) return;
    motion_factors_.clear();
    for (std::size_t j = 0; j < keyframes_.size(); ++j) {
      const Keyframe& keyframe = map_.keyframes.At(keyframes_[j]);
      if (context_.options.use_odometry && keyframe.odometry_link.has_value()) {
        const MotionLink& link = *keyframe.odometry_link;
        AddMotion(link, LiftedCovariance(link.motion, context_.odometry_noise), j, problem);
      }
      for (const MotionLink& link : keyframe.laser_links) {
        const Eigen::Matrix3d planar = CovarianceWithFloor(link.motion, context_.laser_floor);
        AddMotion(link, LiftedCovariance(link.motion, planar, context_.odometry_noise), j, problem);
      }
    }
  }

  void AddMotion(const MotionLink& link, const Matrix6d& covariance, std::size_t j, ceres::Problem* problem) {
    const std::size_t i = IndexOf(link.from);
    if (i == keyframes_.size() || (!IsFree(keyframes_[i]) && !IsFree(keyframes_[j]))) return;
    const Matrix6d S = SquareRootInformation(covariance);
    const Rigid3 T_i_j = Embed3(link.motion.T_i_j);
    motion_factors_.emplace_back(T_i_j, S(kPlanarRows, Eigen::all));
    problem->AddResidualBlock(&motion_factors_.back(), &odometry_loss_, PoseBlock(i), PoseBlock(j));
    motion_factors_.emplace_back(T_i_j, S(kFloorRows, Eigen::all));
    problem->AddResidualBlock(&motion_factors_.back(), &tilt_loss_, PoseBlock(i), PoseBlock(j));
  }

  void AddFloor(ceres::Problem* problem) {
    if (context_.planar.mode != PlanarMode::kSoftSe3) return;
    for (const KeyframeId id : request_.free_keyframes) {
      if (IsOnFloor(id)) problem->AddResidualBlock(&floor_, nullptr, PoseBlock(IndexOf(id)));
    }
  }

  void AddFloorPoints(ceres::Problem* problem) {
    for (const std::size_t landmark : floor_landmarks_) {
      problem->AddResidualBlock(&floor_point_, &floor_point_loss_, PointBlock(landmark));
    }
  }

  // Landmarks on the floor, seen by keyframes on it only.
  void FindFloor() {
    std::vector<bool> on_floor(request_.landmarks.size(), true);
    std::vector<int> seen(request_.landmarks.size(), 0);
    for (const BlockObservation& o : observations_) {
      if (!map_.keyframes.At(keyframes_[o.keyframe]).on_floor) on_floor[o.landmark] = false;
      ++seen[o.landmark];
    }
    constexpr int kMinObservations = 3;
    std::vector<std::size_t> candidates;
    std::vector<Eigen::Vector3d> points;
    for (std::size_t i = 0; i < request_.landmarks.size(); ++i) {
      if (!on_floor[i] || seen[i] < kMinObservations) continue;
      candidates.push_back(i);
      points.push_back(map_.landmarks.At(request_.landmarks[i]).p_map);
    }
    for (const std::size_t k : FindFloorPoints(points).indices) floor_landmarks_.push_back(candidates[k]);
  }

  const Map& map_;
  const BundleRequest& request_;
  const MeasurementModel& context_;
  std::vector<KeyframeId> keyframes_;  // free and fixed, ascending
  std::vector<double> blocks_;
  std::vector<BlockObservation> observations_;
  std::deque<ReprojectionFactor> reprojections_;  // one per observation; cost functions cannot be moved
  std::deque<PlanarReprojectionFactor> inflated_;
  std::deque<RelativePoseFactor<3>> motion_factors_;
  PlanarPriorFactor floor_{context_.planar.sigma_height, context_.planar.sigma_tilt};
  std::vector<std::size_t> floor_landmarks_;  // indices into the landmark blocks
  FloorPointFactor floor_point_{context_.planar.sigma_floor_point};
  PoseManifold manifold_;
  ceres::CauchyLoss floor_point_loss_{2.0};  // sigmas
  FloorPoseManifold floor_manifold_;
  ceres::HuberLoss pixel_loss_{std::sqrt(kChi2TwoDof95)};
  ceres::CauchyLoss odometry_loss_{context_.options.odometry_loss};
  ceres::CauchyLoss tilt_loss_{context_.options.tilt_loss};
};

}  // namespace

BundleResult AdjustBundle(const Map& map, const BundleRequest& request, const MeasurementModel& context) {
  BundleResult result;
  const Stopwatch build;
  BundleProblem problem(map, request, context);
  result.times.push_back({"bundle.build", build.Milliseconds()});
  if (problem.observation_count() == 0 || request.free_keyframes.empty()) {
    result.message = "nothing to adjust";
    return result;
  }
  result.observations = problem.observation_count();
  const auto solve_and_classify = [&] {
    result.converged = problem.Solve(context.options.max_iterations, &result);
    const Stopwatch classify;
    problem.Classify();
    result.times.push_back({"bundle.classify", classify.Milliseconds()});
  };
  solve_and_classify();
  if (result.converged && context.options.drop_outliers) solve_and_classify();
  if (result.converged) problem.Report(&result);
  return result;
}

MapEdit ToEdit(const BundleResult& result) {
  MapEdit edit;
  edit.reserve(result.poses.size() + result.points.size() + result.outliers.size());
  for (const auto& [id, T_map_base] : result.poses) edit.emplace_back(SetKeyframePose{id, T_map_base});
  for (const auto& [id, p_map] : result.points) edit.emplace_back(SetLandmarkPosition{id, p_map});
  for (const auto& [landmark, keyframe] : result.outliers) edit.emplace_back(EraseObservation{landmark, keyframe});
  return edit;
}

BundleRequest WholeMapRequest(const Map& map) {
  BundleRequest request;
  for (const auto& [id, keyframe] : map.keyframes) {
    (request.fixed_keyframes.empty() ? request.fixed_keyframes : request.free_keyframes).push_back(id);
  }
  for (const auto& [id, landmark] : map.landmarks) {
    if (landmark.observations.size() >= 2) request.landmarks.push_back(id);
  }
  return request;
}

}  // namespace planar_vslam
