#include "planar_vslam/frontend/tracker.h"

#include <algorithm>
#include <utility>

#include "frame_track.h"
#include "planar_vslam/geometry/check.h"
#include "planar_vslam/map/queries.h"
#include "planar_vslam/planar/scale_recovery.h"

namespace planar_vslam {
namespace {

constexpr std::size_t kWellObserved = 2;  // keyframes
constexpr std::size_t kYoungMap = 30;     // keyframes: the ruler of all that follows, not to be made of few

}  // namespace

Rigid3 LastFrame::ReferencePose(const Map& map) const {
  const Keyframe* keyframe = map.keyframes.Find(reference);
  return keyframe != nullptr ? keyframe->T_map_base : T_map_ref;
}

void LastFrame::ReferTo(KeyframeId other, const Rigid3& T_map_other, const Rigid3& T_other_reference) {
  reference = other;
  T_map_ref = T_map_other;
  T_ref_base = T_other_reference * T_ref_base;
  if (anchor.has_value()) anchor->start.T_ref_base = T_other_reference * anchor->start.T_ref_base;
}

void ScaleAgreement::Add(double way, KeyframeId newest) {
  constexpr double kEnough = 0.15;  // m: half of it is more than ten standard deviations of view and odometry
  way_ += way;
  if (way_ < kEnough) return;
  until_ = std::max(until_, waiting_);
  Disagree(newest);
}

void ScaleAgreement::Disagree(KeyframeId newest) {
  waiting_ = newest;
  way_ = 0.0;
}

void Tracker::Start(const Map& map, KeyframeId keyframe) {
  last_ = LastFrame{};
  last_->T_base_camera = map.keyframes.At(keyframe).T_base_camera;
  last_->tracked = true;
  last_->wanted = OdometryAnchor{};
  last_->agreement = ScaleAgreement(std::prev(map.keyframes.end())->first);
  OnKeyframe(map, keyframe, Rigid3());
}

void Tracker::StartUnlocalized() { *this = Tracker(context_); }

void Tracker::StartAt(const Map& map, const Rigid3& T_map_base, const Matrix6d& covariance) {
  PV_CHECK(!map.keyframes.empty(), "a pose in a map without keyframes");
  *this = Tracker(context_);
  const auto distance = [&T_map_base](const auto& entry) {
    return (entry.second.T_map_base.translation - T_map_base.translation).squaredNorm();
  };
  const auto nearest =
      std::min_element(map.keyframes.begin(), map.keyframes.end(),
                       [&distance](const auto& a, const auto& b) { return distance(a) < distance(b); });
  Anchor(map, nearest->first, T_map_base);
  last_->T_base_camera = nearest->second.T_base_camera;
  last_->covariance = last_->filtered_covariance = covariance;
  last_->given = true;
}

std::optional<Rigid3> Tracker::LastPose(const Map& map) const {
  return last_.has_value() ? std::optional(last_->T_map_base(map)) : std::nullopt;
}

void Tracker::OnMapScaled(const Map& map, double scale) {
  if (!last_.has_value()) return;
  const Keyframe* reference = map.keyframes.Find(last_->reference);
  const Rigid3 T_refbase_camera = reference != nullptr ? reference->T_base_camera : last_->T_base_camera;
  last_->T_ref_base = ScaleCameraMotion(last_->T_ref_base, T_refbase_camera, last_->T_base_camera, scale);
  last_->anchor.reset();
  last_->T_map_ref = last_->ReferencePose(map);
  last_->velocity.reset();
}

void Tracker::OnImageOffset(const Map& map, const Rigid3& reference_shift, const Rigid3& shift) {
  if (!last_.has_value()) return;
  last_->T_ref_base = reference_shift * last_->T_ref_base * shift.Inverse();
  last_->T_map_ref = map.keyframes.Contains(last_->reference) ? last_->ReferencePose(map)
                                                              : last_->T_map_ref * reference_shift.Inverse();
  last_->T_base_camera = shift * last_->T_base_camera;
  last_->anchor.reset();
  last_->velocity.reset();
}

std::optional<KeyframeId> Tracker::reference() const {
  return last_.has_value() ? std::optional(last_->reference) : std::nullopt;
}

void Tracker::OnKeyframe(const Map& map, KeyframeId keyframe, const Rigid3& T_keyframe_last) {
  if (!last_.has_value()) return;
  const Keyframe& k = map.keyframes.At(keyframe);
  last_->ReferTo(keyframe, k.T_map_base, T_keyframe_last * last_->T_ref_base.Inverse());
  if (last_->wanted.has_value()) last_->anchor = std::exchange(last_->wanted, std::nullopt);
  const std::vector<LandmarkId> landmarks = ValidOnly(k.landmarks);
  if (last_->tracked) last_->landmarks = landmarks;
  reference_landmarks_ = CountObserved(map, landmarks, kWellObserved);
  frames_since_keyframe_ = 0;
}

bool Tracker::FindFirstPose(const Map& map, FrameTrack* frame) {
  constexpr int kPatience = 20;     // blind frames during which the robot is taken to be about where odometry says
  constexpr int kGlobalPeriod = 5;  // frames between searches of the whole map from then on: they cost most
  PlaceExpectation expected;
  expected.T_last_now = frame->OdometryStep();
  if (localized()) {
    if (frame->FollowLastFrame()) return true;
    if (!frame->prediction().from_odometry) return frame->Take(places_.FindAnywhere(map, frame->view()));
    if (frame->SearchAroundPrediction()) return true;
    if (frame->IsFixed()) return false;  // the robot is where the laser says
    const bool anywhere = last_->blind_frames >= kPatience && last_->blind_frames % kGlobalPeriod == 0;
    if (!anywhere) expected.T_map_base = frame->prediction().T_map_base;
  }
  const Stopwatch searching;
  const bool found = frame->Take(places_.FindConfirmed(map, frame->view(), expected));
  frame->AddTime("track.place_search", searching);
  return found;
}

TrackResult Tracker::Track(const TrackInput& input, const Map& map) {
  places_.ForgetSeen();
  FrameTrack frame(context_, input, map, last_.has_value() ? &*last_ : nullptr, floor_.on_floor());
  TrackResult result;
  const auto may_be = [&] { return input.may_jump || (localized() && !frame.IsJump()); };
  bool found = FindFirstPose(map, &frame) && frame.TrackLocalMap() && !frame.IsLookAlike() && may_be();
  bool anchored = localized();
  if (found && anchored) {
    using Settled = FrameTrack::Settled;
    const Settled settled =
        last_->anchor.has_value() ? frame.SettleFrom(*last_->anchor, last_->ReferencePose(map)) : Settled::kByItself;
    found = settled != Settled::kDoubtful;
    anchored = settled != Settled::kByItself;
  }
  if (found) {
    places_.Forget();
    result = frame.Found();
    if (localized() && last_->given) {  // what was off is the pose that was given, not odometry
      result.odometry_rejected = false;
      result.slip.setZero();
    }
    result.status = localized() && last_->tracked ? TrackingState::kTracking : TrackingState::kRelocalized;
    result.jumped = !localized() || frame.IsJump();
    if (result.jumped) Adopt(map, result);
  } else {
    result = frame.Predicted();
  }
  result.times = frame.times();
  if (!localized()) return result;
  if (input.slot != KeyframeSlot::kNone && result.status != TrackingState::kLost && WantsKeyframe(input, map, result)) {
    (input.slot == KeyframeSlot::kFree ? result.wants_keyframe : result.keyframe_waits) = true;
  }
  if (result.wants_keyframe && result.inliers > 0) {
    const std::optional<FloorReading> reading = frame.ReadFloorOf(result);
    if (reading.has_value()) result.off_floor_since = floor_.Add(*reading);
  }
  result.on_floor = floor_.on_floor();
  Remember(input, map, frame, anchored, &result);
  return result;
}

bool Tracker::WantsKeyframe(const TrackInput& input, const Map& map, const TrackResult& result) const {
  const TrackerOptions& o = context_.options;
  if (last_->given || frames_since_keyframe_ < o.keyframe_min_gap) return false;
  const Rigid3 T_map_camera = result.T_map_base * input.T_base_camera;
  const Keyframe* reference = map.keyframes.Find(last_->reference);
  if (reference == nullptr) return true;
  const Rigid3 moved = reference->T_map_camera().Inverse() * T_map_camera;
  const double angle = LogSo3(moved.rotation).norm();
  if (result.status == TrackingState::kOdometry) {
    constexpr double kBlindDistance = 0.25;  // m between keyframes that rest on odometry alone
    return static_cast<int>(input.features->keypoints.size()) >= o.keyframe_min_features &&
           (moved.translation.norm() > kBlindDistance || angle > o.keyframe_angle);
  }
  const std::vector<LandmarkId>& seen = result.matches.landmarks;
  const bool rich = map.keyframes.size() >= kYoungMap && CountObserved(map, seen, kConfirmed) >= o.keyframe_rich_view;
  const double ratio = rich ? o.keyframe_rich_ratio : o.keyframe_ratio;
  if (CountObserved(map, seen, kWellObserved) < ratio * reference_landmarks_) return true;
  return angle > o.keyframe_angle ||
         moved.translation.norm() > o.keyframe_distance * MedianDepth(map, result.matches.landmarks, T_map_camera);
}

void Tracker::Anchor(const Map& map, KeyframeId reference, const Rigid3& T_map_base) {
  const Keyframe& keyframe = map.keyframes.At(reference);
  last_ = LastFrame{};
  last_->reference = reference;
  last_->agreement = ScaleAgreement(std::prev(map.keyframes.end())->first);
  last_->T_map_ref = keyframe.T_map_base;
  last_->T_ref_base = keyframe.T_map_base.Inverse() * T_map_base;
  reference_landmarks_ = CountObserved(map, keyframe.landmarks, kWellObserved);
}

void Tracker::Adopt(const Map& map, const TrackResult& result) {
  const std::vector<KeyframeId> voted = VotedKeyframes(map, result.matches.landmarks, 1);
  PV_CHECK(!voted.empty(), "a pose from vision without landmarks");
  Anchor(map, voted.front(), result.T_map_base);
}

void Tracker::Remember(const TrackInput& input, const Map& map, const FrameTrack& frame, bool anchored,
                       TrackResult* result) {
  const Rigid3 T_map_last = last_->T_map_base(map);
  const bool tracked = result->status == TrackingState::kTracking || result->status == TrackingState::kRelocalized;
  if (tracked && last_->tracked) {
    last_->velocity = T_map_last.Inverse() * result->T_map_base;
  } else {
    last_->velocity.reset();
  }
  if (!map.keyframes.Contains(last_->reference)) {
    const auto& [newest, keyframe] = *std::prev(map.keyframes.end());
    last_->ReferTo(newest, keyframe.T_map_base, keyframe.T_map_base.Inverse() * last_->T_map_ref);
  }
  last_->T_map_ref = last_->ReferencePose(map);
  last_->T_ref_base = last_->T_map_ref.Inverse() * result->T_map_base;
  last_->T_base_camera = input.T_base_camera;
  last_->covariance = result->covariance;
  last_->filtered_covariance = frame.FilteredCovariance(tracked);
  if (tracked) last_->landmarks = ValidOnly(result->matches.landmarks);
  last_->tracked = tracked;
  last_->blind_frames = tracked ? 0 : last_->blind_frames + 1;
  last_->given = last_->given && !tracked;
  ++frames_since_keyframe_;
  RememberOdometry(input, anchored, result->wants_keyframe);
  const KeyframeId newest = std::prev(map.keyframes.end())->first;
  if (anchored && tracked && input.odometry.has_value()) {
    last_->agreement.Add(input.odometry->distance, newest);
  } else {
    last_->agreement.Disagree(newest);
  }
  result->reference = last_->reference;
  result->T_ref_base = last_->T_ref_base;
}

void Tracker::RememberOdometry(const TrackInput& input, bool anchored, bool wants_keyframe) {
  if (anchored && input.odometry.has_value()) {
    for (std::optional<OdometryAnchor>* from : {&last_->anchor, &last_->wanted}) {
      if (from->has_value()) (*from)->since = Compose((*from)->since, *input.odometry);
    }
  } else {
    last_->anchor.reset();
    last_->wanted.reset();
    const bool starts_here = input.slot != KeyframeSlot::kNone && input.odometry.has_value() && last_->tracked;
    if (starts_here) last_->anchor = OdometryAnchor{{last_->T_ref_base, last_->covariance}, PlanarMotion{}};
  }
  if (!wants_keyframe) return;
  last_->wanted = OdometryAnchor{};
  if (!last_->tracked) last_->wanted->start.covariance = last_->covariance;
}

}  // namespace planar_vslam
