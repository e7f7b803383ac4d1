#include "frame_track.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "planar_vslam/geometry/chi_square.h"
#include "planar_vslam/geometry/tangent_parts.h"
#include "planar_vslam/map/queries.h"
#include "pose_difference.h"

namespace planar_vslam {
namespace {

constexpr double kWideRatio = 0.75;  // a wide window shows many that look alike: strict
constexpr int kWideDistance = 60;    // bits, likewise

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

// Whether what is seen of a motion is less than half of the way that the wheels tell, at the same turn. Two views that
// look alike, or that are too near each other, make landmarks much nearer than what they show: these agree with each
// other about it.
bool FallsShort(const Rigid3& seen, const Rigid3& measured, const Matrix6d& covariance) {
  constexpr double kShare = 0.5;
  constexpr double kSigmas = 3.0;
  const double turn = LogSe3(measured.Inverse() * seen)[5];
  return seen.translation.norm() < kShare * measured.translation.norm() &&
         std::abs(turn) < kSigmas * std::sqrt(covariance(5, 5));
}

bool MapHasFloor(const TrackerContext& context, const Map& map) {
  return map.metric && context.planar.mode != PlanarMode::kOff;
}

// px that a landmark may lie off, one sigma.
double PixelSigmaOf(const PosePrediction& prediction, const CameraModel& camera) {
  constexpr double kTypicalDepth = 3.0;  // m, turns a position error into pixels
  const double heading = std::sqrt(prediction.covariance(5, 5));
  const double position = std::sqrt(prediction.covariance.topLeftCorner<2, 2>().trace());
  return camera.fx * std::hypot(heading, position / kTypicalDepth);
}

}  // namespace

FrameTrack::FrameTrack(const TrackerContext& context, const TrackInput& input, const Map& map, const LastFrame* last,
                       bool on_floor)
    : context_(context),
      input_(input),
      map_(map),
      last_(last),
      view_{input.features, input.T_base_camera, context.camera, context.planar, context.pixel_sigma} {
  if (!on_floor || !MapHasFloor(context, map)) view_.planar.mode = PlanarMode::kOff;
  if (last_ != nullptr) {
    prediction_ = Predict(last_->filtered_covariance);
    told_ = Predict(last_->covariance);
  }
  used_ = prediction_;
}

std::optional<Rigid3> FrameTrack::OdometryStep() const {
  if (!map_.metric || !input_.odometry.has_value()) return std::nullopt;
  return Embed3(input_.odometry->T_i_j);
}

PosePrediction FrameTrack::PredictWithoutOdometry() const {
  const Rigid3 T_map_last = last_->T_map_base(map_);
  return {last_->velocity.has_value() && last_->tracked ? T_map_last * *last_->velocity : T_map_last,
          last_->filtered_covariance, false};
}

PosePrediction FrameTrack::Predict(const Matrix6d& covariance) const {
  const std::optional<Rigid3> step = OdometryStep();
  if (!step.has_value()) return PredictWithoutOdometry();
  return Fixed({last_->T_map_base(map_) * *step,
                Propagate(covariance, *step) + LiftedCovariance(*input_.odometry, context_.odometry_noise), true});
}

// A Kalman update. Where the wheels slipped, what they missed is part of their covariance first.
PosePrediction FrameTrack::Fixed(PosePrediction prediction) const {
  if (!input_.fix.has_value()) return prediction;
  const PlanarFix& fix = *input_.fix;
  const Eigen::Vector3d off = LogSe2(ProjectToPlane(prediction.T_map_base).Inverse() * fix.T_map_base);
  Matrix6d& P = prediction.covariance;
  const auto innovation = [&]() -> Eigen::Matrix3d { return P(kPlanarRows, kPlanarRows) + fix.covariance; };
  if (off.dot(innovation().ldlt().solve(off)) > kChi2ThreeDof999) P(kPlanarRows, kPlanarRows) += off * off.transpose();
  const Eigen::Matrix<double, 6, 3> cross = P(Eigen::all, kPlanarRows);
  const Eigen::Matrix<double, 6, 3> gain = innovation().ldlt().solve(cross.transpose()).transpose();
  prediction.T_map_base = prediction.T_map_base * ExpSe3(gain * off);
  const Matrix6d reduced = P - gain * cross.transpose();
  P = 0.5 * (reduced + reduced.transpose());
  return prediction;
}

bool FrameTrack::FollowLastFrame() {
  if (!last_->tracked) return false;
  if (SearchLastFrame(used_.T_map_base) || SearchTipped()) return true;
  if (!prediction_.from_odometry || IsFixed()) return false;
  used_ = PredictWithoutOdometry();
  if (SearchLastFrame(used_.T_map_base)) return true;
  used_ = prediction_;
  return false;
}

bool FrameTrack::SearchLastFrame(const Rigid3& T_map_start) {
  constexpr std::array<double, 2> kWindows{1.0, 2.5};  // times tracker.frame_search_radius
  constexpr double kRatio = 0.9;                       // few landmarks, and most of them are there: loose
  constexpr int kEnoughMatches = 20;
  for (const double window : kWindows) {
    result_.matches = FrameMatches{};
    result_.T_map_base = T_map_start;
    ProjectionSearchOptions search;
    search.radius = window * context_.options.frame_search_radius;
    search.ratio = kRatio;
    Match(last_->landmarks, search);
    if (result_.matches.count >= kEnoughMatches && Optimize()) return true;
  }
  return false;
}

// Wheels know nothing of a ramp or sill that tips the base between two images. The camera is turned about its own x
// axis by as much as all it sees has moved; of what the wheels say, x, y and yaw stand.
bool FrameTrack::SearchTipped() {
  if (IsPlanar(view_.planar.mode)) return false;
  const std::optional<double> drop = FindDrop();
  if (!drop.has_value() || std::abs(*drop) < context_.options.frame_search_radius) return false;  // it lies elsewhere
  const Eigen::Vector3d turn(std::atan(*drop / view_.camera.fy), 0.0, 0.0);
  const Rigid3 T_map_camera = prediction_.T_map_base * view_.T_base_camera;
  const Rigid3 T_map_turned = T_map_camera * Rigid3(ExpSo3(turn), Eigen::Vector3d::Zero());
  tipped_ = prediction_.from_odometry;
  if (SearchLastFrame(T_map_turned * view_.T_base_camera.Inverse())) return true;
  tipped_ = false;
  return false;
}

std::optional<double> FrameTrack::FindDrop() {
  constexpr double kSteepest = DegreesToRadians(10.0);
  constexpr std::size_t kEnough = 15;
  result_.matches = FrameMatches{};
  result_.T_map_base = prediction_.T_map_base;
  Match(last_->landmarks, {view_.camera.fy * std::tan(kSteepest), kWideDistance, kWideRatio});
  const Rigid3 T_camera_map = (prediction_.T_map_base * view_.T_base_camera).Inverse();
  std::vector<double> drops;
  for (std::size_t i = 0; i < result_.matches.landmarks.size(); ++i) {
    if (!result_.matches.landmarks[i].valid()) continue;
    const Eigen::Vector3d p_camera = T_camera_map * map_.landmarks.At(result_.matches.landmarks[i]).p_map;
    drops.push_back(view_.features->keypoints[i].pixel.cast<double>().y() -
                    view_.camera.ProjectUndistorted(p_camera).y());
  }
  if (drops.size() < kEnough) return std::nullopt;
  const auto middle = drops.begin() + static_cast<std::ptrdiff_t>(drops.size() / 2);
  std::nth_element(drops.begin(), middle, drops.end());
  const double median = *middle;
  const auto near = std::count_if(drops.begin(), drops.end(), [&](double drop) {
    return std::abs(drop - median) < context_.options.frame_search_radius;
  });
  const bool most = 2 * static_cast<std::size_t>(near) > drops.size() && static_cast<std::size_t>(near) >= kEnough;
  return most ? std::optional<double>(median) : std::nullopt;
}

bool FrameTrack::SearchAroundPrediction() {
  constexpr double kReach = 2.0;   // times tracker.nearby_distance: the pose is not well known
  constexpr double kSigmas = 3.0;  // of the prediction, in pixels, make the window
  const TrackerOptions& o = context_.options;
  const Rigid3 T_map_camera = used_.T_map_base * view_.T_base_camera;
  const std::vector<KeyframeId> keyframes = NearbyKeyframes(
      map_, T_map_camera, kReach * o.nearby_distance, o.nearby_angle, static_cast<std::size_t>(o.local_keyframes));
  ProjectionSearchOptions search;
  search.radius = std::clamp(kSigmas * PixelSigmaOf(used_, view_.camera), o.frame_search_radius, o.rematch_radius_max);
  search.ratio = kWideRatio;
  search.max_distance = kWideDistance;
  result_.matches = FrameMatches{};
  result_.T_map_base = used_.T_map_base;
  Match(LandmarksOf(map_, keyframes), search);
  return result_.matches.count >= o.min_inliers_rematch && Optimize() && result_.inliers >= o.min_inliers_rematch &&
         !result_.odometry_rejected;
}

bool FrameTrack::Take(std::optional<Placement> placement) {
  used_.from_odometry = false;
  if (!placement.has_value()) return false;
  found_again_ = true;
  result_ = TrackResult{};
  result_.T_map_base = placement->T_map_base;
  result_.covariance = placement->covariance;
  result_.inliers = placement->matches.count;
  result_.matches = std::move(placement->matches);
  return true;
}

bool FrameTrack::TrackLocalMap() {
  constexpr std::size_t kNearby = 10;  // keyframes beside those that see the same
  const TrackerOptions& o = context_.options;
  const Rigid3 T_map_camera = result_.T_map_base * view_.T_base_camera;
  std::vector<KeyframeId> local =
      VotedKeyframes(map_, result_.matches.landmarks, static_cast<std::size_t>(o.local_keyframes));
  if (map_.metric) {
    const std::vector<KeyframeId> near =
        NearbyKeyframes(map_, T_map_camera, o.nearby_distance, o.nearby_angle, kNearby);
    local.insert(local.end(), near.begin(), near.end());
  }
  ProjectionSearchOptions search;
  search.radius = o.map_search_radius;
  result_.matches.visible = ValidOnly(result_.matches.landmarks);
  Match(LandmarksOf(map_, local), search);
  return Optimize();
}

void FrameTrack::Match(const std::vector<LandmarkId>& candidates, const ProjectionSearchOptions& search) {
  const Stopwatch matching;
  SearchByProjection(map_, candidates, result_.T_map_base * view_.T_base_camera, view_.camera, *view_.features, search,
                     &result_.matches);
  AddTime("track.match", matching);
}

bool FrameTrack::Optimize() {
  const Stopwatch posing;
  std::vector<PoseObservation> observations = ObservationsOf(map_, view_, result_.matches);
  PoseOnlyProblem problem = PoseProblem(view_, result_.T_map_base);
  if (used_.from_odometry)
    problem.prior = PosePrior{used_.T_map_base, SquareRootInformation(used_.covariance), tipped_};
  PoseOnlyResult pose = OptimizePose(problem, &observations);
  const auto is_beyond = [&](const std::array<int, 3>& rows) {
    return used_.from_odometry &&
           IsBeyond(LogSe3(used_.T_map_base.Inverse() * pose.T_map_base), used_.covariance, rows);
  };
  const auto optimize_again = [&] {
    for (PoseObservation& o : observations) o.inlier = true;
    pose = OptimizePose(problem, &observations);
  };
  result_.tilted = tipped_ || is_beyond(kFloorRows);
  if (result_.tilted && !tipped_) {  // a sill, a ramp: what the wheels measured stands
    problem.prior->planar = true;
    optimize_again();
  }
  result_.odometry_rejected = is_beyond(kPlanarRows);
  if (result_.odometry_rejected && IsFixed()) {
    result_.odometry_rejected = false;  // nor did the wheels slip: the laser agrees with them
    return false;
  }
  if (result_.odometry_rejected) {  // slip, or a wrong match: let vision speak alone
    problem.prior.reset();
    optimize_again();
  }
  result_.T_map_base = pose.T_map_base;
  result_.inliers = pose.inliers;
  result_.covariance = CovarianceOf(pose);
  KeepInliers(observations, &result_.matches);
  AddTime("track.pose", posing);
  const bool one_thing = input_.slot == KeyframeSlot::kNone && ContradictsOdometry() && !IsSpread();
  if (one_thing || (SaysThatItStands() && !IsConfirmed())) {
    result_.odometry_rejected = false;
    return false;
  }
  const bool odometry_agrees = used_.from_odometry && !result_.odometry_rejected;
  const TrackerOptions& o = context_.options;
  return result_.inliers >= (odometry_agrees ? o.min_inliers_odometry : o.min_inliers);
}

FrameTrack::Settled FrameTrack::SettleFrom(const OdometryAnchor& anchor, const Rigid3& T_map_ref) {
  if (!used_.from_odometry || result_.odometry_rejected || !OdometryStep().has_value()) return Settled::kByItself;
  const Stopwatch posing;
  const PlanarMotion since = Compose(anchor.since, *input_.odometry);
  const Rigid3 moved = Embed3(since.T_i_j);
  const Rigid3 T_map_predicted = T_map_ref * anchor.start.T_ref_base * moved;
  const Matrix6d covariance =
      Propagate(anchor.start.covariance, moved) + LiftedCovariance(since, context_.odometry_noise);
  std::vector<PoseObservation> observations = ObservationsOf(map_, view_, result_.matches);
  PoseOnlyProblem problem = PoseProblem(view_, result_.T_map_base);
  problem.prior = PosePrior{T_map_predicted, SquareRootInformation(covariance), result_.tilted};
  const PoseOnlyResult pose = OptimizePose(problem, &observations);
  AddTime("track.pose", posing);
  const Rigid3& T_map_seen = result_.T_map_base;
  if (IsBeyond(LogSe3(T_map_predicted.Inverse() * pose.T_map_base), covariance, kPlanarRows) ||
      IsBeyond(LogSe3(pose.T_map_base.Inverse() * T_map_seen), CovarianceOf(pose), kPlanarRows)) {
    const Rigid3 T_start_seen = (T_map_ref * anchor.start.T_ref_base).Inverse() * T_map_seen;
    return FallsShort(T_start_seen, moved, covariance) && !IsConfirmed() ? Settled::kDoubtful : Settled::kByItself;
  }
  settled_ = pose;
  return Settled::kFromAnchor;
}

bool FrameTrack::ContradictsOdometry() const {
  return prediction_.from_odometry &&
         IsBeyond(LogSe3(prediction_.T_map_base.Inverse() * result_.T_map_base), prediction_.covariance, kPlanarRows);
}

bool FrameTrack::SaysThatItStands() const {
  const std::optional<Rigid3> step = OdometryStep();
  return step.has_value() && ContradictsOdometry() &&
         FallsShort(last_->T_map_base(map_).Inverse() * result_.T_map_base, *step, prediction_.covariance);
}

bool FrameTrack::IsConfirmed() const {
  constexpr std::size_t kFewKeyframes = 6;  // where hardly a landmark can have been seen by so many
  if (found_again_ || map_.keyframes.size() < kFewKeyframes) return true;
  const KeyframeId until = last_->agreement.until();
  const auto is_confirmed = [&](LandmarkId id) {
    const std::vector<Observation>& seen = map_.landmarks.At(id).observations;
    const auto agreed = [until](const Observation& o) { return !(until < o.keyframe); };
    return std::count_if(seen.begin(), seen.end(), agreed) >= static_cast<std::ptrdiff_t>(kConfirmed);
  };
  const std::vector<LandmarkId> inliers = ValidOnly(result_.matches.landmarks);
  return std::count_if(inliers.begin(), inliers.end(), is_confirmed) >= context_.options.min_inliers_odometry;
}

bool FrameTrack::IsSpread() const {
  constexpr std::size_t kColumns = 4, kRows = 3;
  constexpr std::size_t kLeast = 5;  // of twelve parts of the image: one thing at some distance fills four
  constexpr int kInPart = 2;         // inliers, in one that counts
  std::array<int, kColumns * kRows> inliers{};
  for (std::size_t i = 0; i < result_.matches.landmarks.size(); ++i) {
    if (!result_.matches.landmarks[i].valid()) continue;
    const Eigen::Vector2f& pixel = view_.features->keypoints[i].pixel;
    const auto part = [](float at, int size, std::size_t parts) {
      const float share = std::clamp(at / static_cast<float>(size), 0.0F, 0.999F);
      return static_cast<std::size_t>(share * static_cast<float>(parts));
    };
    ++inliers[part(pixel.y(), view_.camera.height, kRows) * kColumns + part(pixel.x(), view_.camera.width, kColumns)];
  }
  return std::count_if(inliers.begin(), inliers.end(), [](int n) { return n >= kInPart; }) >=
         static_cast<std::ptrdiff_t>(kLeast);
}

bool FrameTrack::IsJump() const {
  constexpr double kJumpDistance = 1.0;  // m
  constexpr double kJumpAngle = DegreesToRadians(20.0);
  return prediction_.from_odometry && !IsNear(prediction_.T_map_base, result_.T_map_base, kJumpDistance, kJumpAngle);
}

bool FrameTrack::IsLookAlike() const {
  return IsJump() && result_.inliers < PlaceLimits::kLeastShare * static_cast<double>(result_.matches.visible.size());
}

TrackResult FrameTrack::Found() const {
  TrackResult found = result_;
  if (settled_.has_value()) {
    found.T_map_base = settled_->T_map_base;
    found.covariance = CovarianceOf(*settled_);
  }
  found.odometry_rejected = found.odometry_rejected || used_.from_odometry != prediction_.from_odometry;
  if (found.odometry_rejected) {
    found.slip = LogSe2(ProjectToPlane(prediction_.T_map_base).Inverse() * ProjectToPlane(found.T_map_base));
  }
  return found;
}

const Matrix6d& FrameTrack::FilteredCovariance(bool found) const {
  return found ? result_.covariance : prediction_.covariance;
}

TrackResult FrameTrack::Predicted() const {
  TrackResult predicted = result_;
  predicted.status = prediction_.from_odometry ? TrackingState::kOdometry : TrackingState::kLost;
  predicted.T_map_base = told_.T_map_base;
  predicted.covariance = told_.covariance;
  predicted.matches = FrameMatches{};
  predicted.matches.refused = result_.matches.refused;
  predicted.matches.landmarks.resize(view_.features->keypoints.size());
  predicted.inliers = 0;
  return predicted;
}

std::optional<FloorReading> FrameTrack::ReadFloorOf(const TrackResult& found) const {
  if (!MapHasFloor(context_, map_)) return std::nullopt;
  std::vector<PoseObservation> observations = ObservationsOf(map_, view_, found.matches);
  PoseOnlyProblem problem = PoseProblem(view_, found.T_map_base);
  problem.floor = PlanarMode::kOff;
  if (prediction_.from_odometry && !found.odometry_rejected) {
    problem.prior = PosePrior{prediction_.T_map_base, SquareRootInformation(prediction_.covariance), found.tilted};
  }
  const PoseOnlyResult pose = OptimizePose(problem, &observations);
  return ReadFloor(input_.stamp, pose.T_map_base, CovarianceOf(pose), problem.sigma_height, problem.sigma_tilt);
}

}  // namespace planar_vslam
