#include "bundle_problem.h"

#include <algorithm>

#include "planar_vslam/optimize/planar_reprojection_factor.h"
#include "planar_vslam/planar/floor_points.h"

namespace planar_vslam {
namespace {

class ProblemBuilder {
 public:
  ProblemBuilder(const Map& map, const BundleRequest& request, const MeasurementModel& model)
      : map_(map), request_(request), model_(model) {
    problem_.camera = model.camera;
    problem_.planar = model.planar;
    problem_.options = model.options;
    problem_.metric = map.metric;
  }

  BundleProblem Build() {
    AddPoses();
    AddPoints();
    if (map_.metric) AddMotions();
    if (model_.planar.floor_points && model_.planar.mode != PlanarMode::kOff && map_.metric) FindFloor();
    return std::move(problem_);
  }

 private:
  void AddPoses() {
    std::vector<KeyframeId> ids;
    std::merge(request_.free_keyframes.begin(), request_.free_keyframes.end(), request_.fixed_keyframes.begin(),
               request_.fixed_keyframes.end(), std::back_inserter(ids));
    problem_.poses.reserve(ids.size());
    for (const KeyframeId id : ids) {
      const Keyframe& keyframe = map_.keyframes.At(id);
      BundlePose pose{id, keyframe.T_map_base, keyframe.T_base_camera};
      pose.on_floor = map_.metric && keyframe.on_floor;
      if (std::binary_search(request_.free_keyframes.begin(), request_.free_keyframes.end(), id)) {
        const bool planar = IsPlanar(model_.planar.mode) && pose.on_floor;
        pose.freedom = planar ? PoseFreedom::kFloor : PoseFreedom::kFree;
        if (planar) pose.T_map_base = Embed3(ProjectToPlane(pose.T_map_base));
      } else if (id == request_.origin && pose.on_floor && model_.planar.mode == PlanarMode::kSoftSe3) {
        pose.freedom = PoseFreedom::kLevel;
      }
      problem_.poses.push_back(pose);
      keyframes_.push_back(&keyframe);
    }
  }

  std::size_t IndexOf(KeyframeId id) const {
    const auto it = std::lower_bound(problem_.poses.begin(), problem_.poses.end(), id,
                                     [](const BundlePose& pose, KeyframeId i) { return pose.id < i; });
    const bool found = it != problem_.poses.end() && it->id == id;
    return found ? static_cast<std::size_t>(it - problem_.poses.begin()) : problem_.poses.size();
  }

  void AddPoints() {
    std::vector<double> inverse_sigmas;
    for (const double scale : map_.octave_scales) inverse_sigmas.push_back(1.0 / (model_.pixel_sigma * scale));
    problem_.points.reserve(request_.landmarks.size());
    for (const LandmarkId id : request_.landmarks) {
      const Landmark& landmark = map_.landmarks.At(id);
      const auto point = static_cast<std::uint32_t>(problem_.points.size());
      problem_.points.push_back({id, landmark.p_map});
      for (const Observation& o : landmark.observations) {
        const std::size_t pose = IndexOf(o.keyframe);
        if (pose == problem_.poses.size()) continue;
        const Keypoint& keypoint = keyframes_[pose]->features->keypoints[o.keypoint];
        problem_.observations.push_back({static_cast<std::uint32_t>(pose), point, keypoint.pixel.cast<double>(),
                                         inverse_sigmas[static_cast<std::size_t>(keypoint.octave)]});
      }
    }
  }

  void AddMotions() {
    for (std::size_t j = 0; j < keyframes_.size(); ++j) {
      const Keyframe& keyframe = *keyframes_[j];
      if (model_.options.use_odometry && keyframe.odometry_link.has_value()) {
        const MotionLink& link = *keyframe.odometry_link;
        AddMotion(link, LiftedCovariance(link.motion, model_.odometry_noise), j);
      }
      for (const MotionLink& link : keyframe.laser_links) {
        const Eigen::Matrix3d planar = CovarianceWithFloor(link.motion, model_.laser_floor);
        AddMotion(link, LiftedCovariance(link.motion, planar, model_.odometry_noise), j);
      }
    }
  }

  void AddMotion(const MotionLink& link, const Matrix6d& covariance, std::size_t j) {
    const std::size_t i = IndexOf(link.from);
    if (i == problem_.poses.size()) return;
    const auto is_fixed = [this](std::size_t k) { return problem_.poses[k].freedom == PoseFreedom::kFixed; };
    if (is_fixed(i) && is_fixed(j)) return;
    const bool sloped = !problem_.poses[i].on_floor || !problem_.poses[j].on_floor;
    problem_.motions.push_back({i, j, Embed3(link.motion.T_i_j),
                                SquareRootInformation(sloped ? OverSlope(covariance, link.motion) : covariance)});
  }

  // At the foot of a ramp the base tips at once.
  Matrix6d OverSlope(Matrix6d covariance, const PlanarMotion& motion) const {
    const double tilt = model_.planar.sigma_slope, height = tilt * motion.T_i_j.translation.norm();
    covariance.diagonal() += (Vector6d() << 0.0, 0.0, height, tilt, tilt, 0.0).finished().cwiseAbs2();
    return covariance;
  }

  // Landmarks on the floor, seen by keyframes on it only.
  void FindFloor() {
    std::vector<bool> on_floor(problem_.points.size(), true);
    std::vector<int> seen(problem_.points.size(), 0);
    for (const BundleObservation& o : problem_.observations) {
      if (!problem_.poses[o.pose].on_floor) on_floor[o.point] = false;
      ++seen[o.point];
    }
    constexpr int kMinObservations = 3;
    std::vector<std::size_t> candidates;
    std::vector<Eigen::Vector3d> points;
    for (std::size_t i = 0; i < problem_.points.size(); ++i) {
      if (!on_floor[i] || seen[i] < kMinObservations) continue;
      candidates.push_back(i);
      points.push_back(problem_.points[i].p_map);
    }
    for (const std::size_t k : FindFloorPoints(points).indices) problem_.floor_points.push_back(candidates[k]);
  }

  const Map& map_;
  const BundleRequest& request_;
  const MeasurementModel& model_;
  std::vector<const Keyframe*> keyframes_;  // of the poses
  BundleProblem problem_;
};

}  // namespace

std::vector<CameraPose> CameraPoses(const BundleProblem& problem) {
  std::vector<CameraPose> cameras;
  cameras.reserve(problem.poses.size());
  for (const BundlePose& pose : problem.poses) {
    const Rigid3 T_camera_map = (pose.T_map_base * pose.T_base_camera).Inverse();
    cameras.push_back({T_camera_map.R(), T_camera_map.translation});
  }
  return cameras;
}

BundleProblem MakeBundleProblem(const Map& map, const BundleRequest& request, const MeasurementModel& model) {
  return ProblemBuilder(map, request, model).Build();
}

void RefreshWhitening(BundleProblem* problem) {
  if (problem->planar.mode != PlanarMode::kSe2Xyz) return;
  const std::vector<CameraPose> cameras = CameraPoses(*problem);
  problem->whitening.assign(problem->observations.size(), Eigen::Matrix2d::Identity());
  for (std::size_t i = 0; i < problem->observations.size(); ++i) {
    const BundleObservation& o = problem->observations[i];
    const BundlePose& pose = problem->poses[o.pose];
    if (!pose.on_floor) continue;
    const Eigen::Vector3d& p_map = problem->points[o.point].p_map;
    const CameraPose& camera = cameras[o.pose];
    const Eigen::Vector3d p_camera = camera.R * p_map + camera.t;
    if (!(p_camera.z() > kMinDepth)) continue;
    const Eigen::Matrix<double, 2, 3> J_point =
        o.inverse_sigma * (ProjectionJacobian(problem->camera, p_camera) * camera.R);
    problem->whitening[i] = FloorWhitening(FloorErrorJacobian(J_point, p_map - pose.T_map_base.translation),
                                           problem->planar.sigma_height, problem->planar.sigma_tilt);
  }
}

std::size_t Classify(BundleProblem* problem) {
  const std::vector<CameraPose> cameras = CameraPoses(*problem);
  RefreshWhitening(problem);
  std::size_t changed = 0;
  for (std::size_t i = 0; i < problem->observations.size(); ++i) {
    BundleObservation& o = problem->observations[i];
    const CameraPose& camera = cameras[o.pose];
    const Eigen::Vector3d p_camera = camera.R * problem->points[o.point].p_map + camera.t;
    bool inlier = p_camera.z() > kMinDepth;
    if (inlier) {
      Eigen::Vector2d e = o.inverse_sigma * (problem->camera.ProjectUndistorted(p_camera) - o.pixel);
      if (!problem->whitening.empty()) e = (problem->whitening[i] * e).eval();
      inlier = e.squaredNorm() <= kChi2TwoDof95;
    }
    changed += inlier != o.inlier ? 1 : 0;
    o.inlier = inlier;
  }
  return changed;
}

}  // namespace planar_vslam
