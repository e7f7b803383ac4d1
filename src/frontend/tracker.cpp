#include "planar_vslam/frontend/tracker.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "planar_vslam/geometry/tangent_parts.h"
#include "planar_vslam/map/queries.h"
#include "planar_vslam/optimize/pose_only.h"
#include "planar_vslam/planar/scale_recovery.h"
#include "planar_vslam/recognition/place_index.h"
#include "planar_vslam/recognition/relocalizer.h"

namespace planar_vslam {
namespace {

constexpr double kChi2ThreeDof999 = 16.266;  // chi-square, 3 dof, 99.9 %
constexpr std::size_t kRelocalizationCandidates = 8;

Matrix6d Propagate(const Matrix6d& covariance, const Rigid3& T_i_j) {
  const Matrix6d adjoint = AdjointSe3(T_i_j.Inverse());
  return adjoint * covariance * adjoint.transpose();
}

// Whether one part of a difference is larger than its covariance explains.
bool IsBeyond(const Vector6d& difference, const Matrix6d& covariance, const std::array<int, 3>& rows) {
  const Eigen::Vector3d part = difference(rows);
  const Eigen::Matrix3d P = covariance(rows, rows);
  return part.dot(P.ldlt().solve(part)) > kChi2ThreeDof999;
}

}  // namespace

void Tracker::Start(const Map& map, KeyframeId keyframe) {
  const Keyframe& k = map.keyframes.At(keyframe);
  last_ = {keyframe, k.T_map_base, Rigid3(), k.T_base_camera, ValidOnly(k.landmarks), Matrix6d::Zero()};
  velocity_.reset();
  visually_tracked_ = true;
  localized_ = true;
  OnKeyframe(map, keyframe, Rigid3());
}

void Tracker::StartUnlocalized() { *this = Tracker(context_); }

void Tracker::OnMapScaled(const Map& map, double scale) {
  const Keyframe* reference = map.keyframes.Find(last_.reference);
  const Rigid3 T_refbase_camera = reference != nullptr ? reference->T_base_camera : last_.T_base_camera;
  last_.T_ref_base = ScaleCameraMotion(last_.T_ref_base, T_refbase_camera, last_.T_base_camera, scale);
  last_.T_map_ref = ReferencePose(map);
  velocity_.reset();
}

void Tracker::OnKeyframe(const Map& map, KeyframeId keyframe, const Rigid3& T_keyframe_last) {
  const Keyframe& k = map.keyframes.At(keyframe);
  last_.reference = keyframe;
  last_.T_map_ref = k.T_map_base;
  last_.T_ref_base = T_keyframe_last;
  const std::vector<LandmarkId> landmarks = ValidOnly(k.landmarks);
  if (visually_tracked_) last_.landmarks = landmarks;
  reference_landmarks_ = CountWellObserved(map, landmarks);
  frames_since_keyframe_ = 0;
}

Rigid3 Tracker::ReferencePose(const Map& map) const {
  const Keyframe* reference = map.keyframes.Find(last_.reference);
  return reference != nullptr ? reference->T_map_base : last_.T_map_ref;
}

Tracker::Prediction Tracker::PredictWithoutOdometry(const Map& map) const {
  const Rigid3 T_map_last = ReferencePose(map) * last_.T_ref_base;
  return {velocity_.has_value() && visually_tracked_ ? T_map_last * *velocity_ : T_map_last, last_.covariance, false};
}

Tracker::Prediction Tracker::Predict(const TrackInput& input, const Map& map) const {
  if (!map.metric || !input.odometry.has_value()) return PredictWithoutOdometry(map);
  const Rigid3 step = Embed3(input.odometry->T_i_j);
  return {ReferencePose(map) * last_.T_ref_base * step,
          Propagate(last_.covariance, step) + LiftedCovariance(*input.odometry, context_.odometry_noise), true};
}

bool Tracker::EnoughInliers(const Prediction& prediction, const TrackResult& result) const {
  const TrackerOptions& o = context_.options;
  const bool odometry_agrees = prediction.from_odometry && !result.odometry_rejected;
  return result.inliers >= (odometry_agrees ? o.min_inliers_odometry : o.min_inliers);
}

bool Tracker::UsesFloor(const Map& map) const { return map.metric && context_.planar.mode != PlanarMode::kOff; }

std::vector<PoseObservation> Tracker::Observations(const TrackInput& input, const Map& map,
                                                   const FrameMatches& matches) const {
  std::vector<PoseObservation> observations;
  observations.reserve(static_cast<std::size_t>(matches.count));
  for (std::size_t i = 0; i < matches.landmarks.size(); ++i) {
    if (!matches.landmarks[i].valid()) continue;
    const Keypoint& keypoint = input.features->keypoints[i];
    const double sigma = context_.pixel_sigma * map.octave_scales[static_cast<std::size_t>(keypoint.octave)];
    observations.push_back({map.landmarks.At(matches.landmarks[i]).p_map, keypoint.pixel.cast<double>(), sigma, true});
  }
  return observations;
}

PoseOnlyProblem Tracker::MakeProblem(const TrackInput& input, const Map& map, const Prediction& prediction,
                                     const Rigid3& start) const {
  PoseOnlyProblem problem;
  problem.T_map_base = start;
  problem.T_base_camera = input.T_base_camera;
  problem.camera = context_.camera;
  problem.floor = UsesFloor(map) && floor_.on_floor() ? context_.planar.mode : PlanarMode::kOff;
  problem.sigma_height = context_.planar.sigma_height;
  problem.sigma_tilt = context_.planar.sigma_tilt;
  if (prediction.from_odometry) {
    problem.prior = PosePrior{prediction.T_map_base, SquareRootInformation(prediction.covariance)};
  }
  return problem;
}

bool Tracker::Optimize(const TrackInput& input, const Map& map, const Prediction& prediction,
                       TrackResult* result) const {
  std::vector<PoseObservation> observations = Observations(input, map, result->matches);
  PoseOnlyProblem problem = MakeProblem(input, map, prediction, result->T_map_base);
  PoseOnlyResult pose = OptimizePose(problem, &observations);
  const auto is_beyond = [&](const std::array<int, 3>& rows) {
    return prediction.from_odometry &&
           IsBeyond(LogSe3(prediction.T_map_base.Inverse() * pose.T_map_base), prediction.covariance, rows);
  };
  const auto optimize_again = [&] {
    for (PoseObservation& o : observations) o.inlier = true;
    pose = OptimizePose(problem, &observations);
  };
  result->tilted = is_beyond(kFloorRows);
  if (result->tilted) {  // a sill, a ramp: what the wheels measured stands
    problem.prior->planar = true;
    optimize_again();
  }
  result->odometry_rejected = is_beyond(kPlanarRows);
  if (result->odometry_rejected) {  // slip, or a wrong match: let vision speak alone
    problem.prior.reset();
    optimize_again();
  }
  result->T_map_base = pose.T_map_base;
  result->inliers = pose.inliers;
  result->covariance = (pose.information + 1e-6 * Matrix6d::Identity()).inverse();
  std::size_t next = 0;
  for (LandmarkId& id : result->matches.landmarks) {
    if (!id.valid() || observations[next++].inlier) continue;
    id = LandmarkId{};
    --result->matches.count;
  }
  return EnoughInliers(prediction, *result);
}

void Tracker::TestFloor(const TrackInput& input, const Map& map, const Prediction& prediction, TrackResult* result) {
  if (!UsesFloor(map)) return;
  std::vector<PoseObservation> observations = Observations(input, map, result->matches);
  PoseOnlyProblem problem = MakeProblem(input, map, prediction, result->T_map_base);
  problem.floor = PlanarMode::kOff;
  if (problem.prior.has_value()) problem.prior->planar = result->tilted;
  if (result->odometry_rejected) problem.prior.reset();
  const PoseOnlyResult pose = OptimizePose(problem, &observations);
  const Matrix6d covariance = (pose.information + 1e-6 * Matrix6d::Identity()).inverse();
  result->off_floor_since =
      floor_.Add(ReadFloor(input.stamp, pose.T_map_base, covariance, problem.sigma_height, problem.sigma_tilt));
}

bool Tracker::TrackLastFrame(const TrackInput& input, const Map& map, const Prediction& prediction,
                             TrackResult* result) const {
  if (!visually_tracked_) return false;
  constexpr int kEnoughMatches = 20;
  for (const double widen : {1.0, 2.5}) {
    result->matches = FrameMatches{};
    result->T_map_base = prediction.T_map_base;
    ProjectionSearchOptions search;
    search.radius = widen * context_.options.frame_search_radius;
    search.ratio = 0.9;
    SearchByProjection(map, last_.landmarks, prediction.T_map_base * input.T_base_camera, context_.camera,
                       *input.features, search, &result->matches);
    if (result->matches.count >= kEnoughMatches && Optimize(input, map, prediction, result)) return true;
  }
  return false;
}

// The map projected around the prediction, window by the prediction's covariance; without odometry, the keyframes
// that look most like the image, one by one.
bool Tracker::Rematch(const TrackInput& input, const Map& map, const Prediction& prediction,
                      TrackResult* result) const {
  const Rigid3 T_map_camera = prediction.T_map_base * input.T_base_camera;
  if (prediction.from_odometry) {
    const std::vector<KeyframeId> keyframes =
        NearbyKeyframes(map, T_map_camera, 2.0 * context_.options.nearby_distance, context_.options.nearby_angle,
                        static_cast<std::size_t>(context_.options.local_keyframes));
    const double heading_sigma = std::sqrt(prediction.covariance(5, 5));
    const double position_sigma = std::sqrt(prediction.covariance.topLeftCorner<2, 2>().trace());
    constexpr double kTypicalDepth = 3.0;  // m, turns a position error into pixels
    const double sigma_px = context_.camera.fx * std::hypot(heading_sigma, position_sigma / kTypicalDepth);
    ProjectionSearchOptions search;
    search.radius =
        std::clamp(3.0 * sigma_px, context_.options.frame_search_radius, context_.options.rematch_radius_max);
    search.ratio = 0.75;
    search.max_distance = 60;
    result->matches = FrameMatches{};
    result->T_map_base = prediction.T_map_base;
    SearchByProjection(map, LandmarksOf(map, keyframes), T_map_camera, context_.camera, *input.features, search,
                       &result->matches);
    return result->matches.count >= context_.options.min_inliers_rematch && Optimize(input, map, prediction, result) &&
           result->inliers >= context_.options.min_inliers_rematch && !result->odometry_rejected;
  }
  PlaceIndex index;
  index.Update(map);
  for (const KeyframeId keyframe : index.Resembling(*input.features, kRelocalizationCandidates)) {
    const auto hypothesis = RelocalizeAgainst(map, keyframe, *input.features, context_.camera);
    if (!hypothesis.has_value()) continue;
    result->matches = hypothesis->matches;
    result->T_map_base = hypothesis->T_map_camera * input.T_base_camera.Inverse();
    if (Optimize(input, map, prediction, result)) return true;
  }
  return false;
}

bool Tracker::TrackLocalMap(const TrackInput& input, const Map& map, const Prediction& prediction,
                            TrackResult* result) const {
  std::vector<KeyframeId> local =
      VotedKeyframes(map, result->matches.landmarks, static_cast<std::size_t>(context_.options.local_keyframes));
  if (map.metric) {
    const std::vector<KeyframeId> near =
        NearbyKeyframes(map, result->T_map_base * input.T_base_camera, context_.options.nearby_distance,
                        context_.options.nearby_angle, 10);
    local.insert(local.end(), near.begin(), near.end());
  }
  ProjectionSearchOptions search;
  search.radius = context_.options.map_search_radius;
  result->matches.visible = ValidOnly(result->matches.landmarks);
  SearchByProjection(map, LandmarksOf(map, local), result->T_map_base * input.T_base_camera, context_.camera,
                     *input.features, search, &result->matches);
  return Optimize(input, map, prediction, result);
}

bool Tracker::WantsKeyframe(const TrackInput& input, const Map& map, const TrackResult& result) const {
  const TrackerOptions& o = context_.options;
  if (frames_since_keyframe_ < o.keyframe_min_gap) return false;
  const Rigid3 T_map_camera = result.T_map_base * input.T_base_camera;
  const Keyframe* reference = map.keyframes.Find(last_.reference);
  if (reference == nullptr) return true;
  const Rigid3 moved = reference->T_map_camera().Inverse() * T_map_camera;
  const double angle = LogSo3(moved.rotation).norm();
  if (result.status == TrackingState::kOdometry) {
    constexpr double kBlindDistance = 0.25;  // m between keyframes that rest on odometry alone
    return static_cast<int>(input.features->keypoints.size()) >= o.keyframe_min_features &&
           (moved.translation.norm() > kBlindDistance || angle > o.keyframe_angle);
  }
  if (CountWellObserved(map, result.matches.landmarks) < o.keyframe_ratio * reference_landmarks_) return true;
  return angle > o.keyframe_angle ||
         moved.translation.norm() > o.keyframe_distance * MedianDepth(map, result.matches.landmarks, T_map_camera);
}

void Tracker::Remember(const TrackInput& input, const Map& map, TrackResult* result) {
  const Rigid3 T_map_last = ReferencePose(map) * last_.T_ref_base;
  const bool tracked = result->status == TrackingState::kTracking || result->status == TrackingState::kRelocalized;
  if (tracked && visually_tracked_) {
    velocity_ = T_map_last.Inverse() * result->T_map_base;
  } else {
    velocity_.reset();
  }
  if (!map.keyframes.Contains(last_.reference)) {
    last_.reference = std::prev(map.keyframes.end())->first;
  }
  last_.T_map_ref = ReferencePose(map);
  last_.T_ref_base = last_.T_map_ref.Inverse() * result->T_map_base;
  last_.T_base_camera = input.T_base_camera;
  last_.covariance = result->covariance;
  if (tracked) last_.landmarks = ValidOnly(result->matches.landmarks);
  visually_tracked_ = tracked;
  blind_frames_ = tracked ? 0 : blind_frames_ + 1;
  ++frames_since_keyframe_;
  result->reference = last_.reference;
  result->T_ref_base = last_.T_ref_base;
}

bool Tracker::FindFirstPose(const TrackInput& input, const Map& map, const Prediction& prediction, Prediction* used,
                            TrackResult* result) {
  *used = prediction;
  if (localized_) {
    if (TrackLastFrame(input, map, prediction, result)) return true;
    if (prediction.from_odometry && visually_tracked_) {  // a large slip: look where the motion so far leads
      *used = PredictWithoutOdometry(map);
      if (TrackLastFrame(input, map, *used, result)) return true;
    }
    *used = prediction;
    if (Rematch(input, map, prediction, result)) return true;
    if (!prediction.from_odometry) return false;
  }
  used->from_odometry = false;
  return ConfirmHypothesis(input, map, *used, result);
}

TrackResult Tracker::Track(const TrackInput& input, const Map& map) {
  const Prediction prediction = localized_ ? Predict(input, map) : Prediction{};
  Prediction used;
  TrackResult result;
  const bool was_tracked = visually_tracked_;
  if (FindFirstPose(input, map, prediction, &used, &result) && TrackLocalMap(input, map, used, &result) &&
      !IsLookAlike(prediction, result)) {
    result.odometry_rejected = result.odometry_rejected || used.from_odometry != prediction.from_odometry;
    if (result.odometry_rejected) {
      result.slip = LogSe2(ProjectToPlane(prediction.T_map_base).Inverse() * ProjectToPlane(result.T_map_base));
    }
    hypothesis_.reset();
    result.status = was_tracked ? TrackingState::kTracking : TrackingState::kRelocalized;
    result.jumped = !localized_ || IsJump(prediction, result);
    if (result.jumped) Adopt(map, result);
  } else {
    result.status = prediction.from_odometry ? TrackingState::kOdometry : TrackingState::kLost;
    result.T_map_base = prediction.T_map_base;
    result.covariance = prediction.covariance;
    result.matches = FrameMatches{};
    result.matches.landmarks.resize(input.features->keypoints.size());
    result.inliers = 0;
    if (!localized_) return result;
  }
  result.wants_keyframe =
      input.may_make_keyframe && result.status != TrackingState::kLost && WantsKeyframe(input, map, result);
  if (result.wants_keyframe && result.inliers > 0) TestFloor(input, map, prediction, &result);
  result.on_floor = floor_.on_floor();
  Remember(input, map, &result);
  return result;
}

}  // namespace planar_vslam
