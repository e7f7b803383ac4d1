// The part of the tracker that finds a pose without trusting the last one: at the start in a known map, after a slip
// while blind, after the robot was kidnapped elsewhere.
#include <algorithm>

#include "planar_vslam/frontend/tracker.h"
#include "planar_vslam/map/queries.h"
#include "planar_vslam/recognition/place_index.h"
#include "planar_vslam/recognition/relocalizer.h"

namespace planar_vslam {
namespace {

bool IsNear(const Rigid3& a, const Rigid3& b, double distance, double angle) {
  const Vector6d difference = LogSe3(a.Inverse() * b);
  return difference.head<3>().norm() < distance && difference.tail<3>().norm() < angle;
}

}  // namespace

// Where the hypothesis leads; else around the odometry pose; else, after a while and at the start, anywhere.
std::vector<KeyframeId> Tracker::HypothesisCandidates(const TrackInput& input, const Map& map,
                                                      const Prediction& prediction,
                                                      const std::optional<Hypothesis>& previous) const {
  constexpr double kSearchDistance = 3.0;  // m around the expected pose
  constexpr double kSearchAngle = DegreesToRadians(60.0);
  constexpr std::size_t kNearCandidates = 3, kGlobalCandidates = 8;
  constexpr int kPatience = 20;     // blind frames during which the robot is taken to be about where odometry says
  constexpr int kGlobalPeriod = 5;  // frames between searches of the whole map from then on: they cost most
  const bool anywhere = !localized_ || (blind_frames_ >= kPatience && blind_frames_ % kGlobalPeriod == 0);
  if (!previous.has_value() && anywhere) {
    PlaceIndex index;
    index.Update(map);
    return index.Resembling(*input.features, kGlobalCandidates);
  }
  Rigid3 T_map_base = prediction.T_map_base;
  if (previous.has_value()) {
    T_map_base = previous->T_map_base;
    if (map.metric && input.odometry.has_value()) T_map_base = T_map_base * Embed3(input.odometry->T_i_j);
  }
  return NearbyKeyframes(map, T_map_base * input.T_base_camera, kSearchDistance, kSearchAngle, kNearCandidates);
}

// The candidate with the most inliers; none where another place explains the image nearly as well.
bool Tracker::BestHypothesis(const TrackInput& input, const Map& map, const Prediction& prediction,
                             const std::vector<KeyframeId>& candidates, TrackResult* best) const {
  constexpr double kRivalShare = 0.6;       // of the best one's inliers; fitted
  constexpr double kSamePlaceDepths = 0.2;  // of the distance to what is seen
  constexpr double kSamePlaceAngle = DegreesToRadians(10.0);
  std::vector<TrackResult> found;
  for (const KeyframeId keyframe : candidates) {
    const auto hypothesis = RelocalizeAgainst(map, keyframe, *input.features, context_.camera);
    if (!hypothesis.has_value()) continue;
    TrackResult result;
    result.matches = hypothesis->matches;
    result.T_map_base = hypothesis->T_map_camera * input.T_base_camera.Inverse();
    if (Optimize(input, map, prediction, &result)) found.push_back(std::move(result));
  }
  if (found.empty()) return false;
  *best = *std::max_element(found.begin(), found.end(),
                            [](const TrackResult& a, const TrackResult& b) { return a.inliers < b.inliers; });
  const double depth = MedianDepth(map, best->matches.landmarks, best->T_map_base * input.T_base_camera);
  return std::all_of(found.begin(), found.end(), [&](const TrackResult& other) {
    return other.inliers < kRivalShare * best->inliers ||
           IsNear(best->T_map_base, other.T_map_base, kSamePlaceDepths * depth, kSamePlaceAngle);
  });
}

// A pose from descriptors alone is held back until three in a row agree: through odometry, or, without it, by being
// near each other.
bool Tracker::ConfirmHypothesis(const TrackInput& input, const Map& map, const Prediction& prediction,
                                TrackResult* result) {
  constexpr double kAgreePosition = 0.10;  // m, with odometry between the frames
  constexpr double kAgreeAngle = DegreesToRadians(3.0);
  constexpr double kAgreeDepths = 0.2;  // of the distance to what is seen, without
  constexpr double kAgreeAngleWithout = DegreesToRadians(15.0);
  constexpr int kConfirmations = 3;
  std::optional<Hypothesis> previous;
  previous.swap(hypothesis_);
  if (!BestHypothesis(input, map, prediction, HypothesisCandidates(input, map, prediction, previous), result)) {
    return false;
  }
  hypothesis_ = Hypothesis{result->T_map_base, 1};
  if (previous.has_value()) {
    const bool through_odometry = map.metric && input.odometry.has_value();
    const Rigid3 expected =
        through_odometry ? previous->T_map_base * Embed3(input.odometry->T_i_j) : previous->T_map_base;
    const double depth = MedianDepth(map, result->matches.landmarks, result->T_map_base * input.T_base_camera);
    const bool agrees = through_odometry
                            ? IsNear(expected, result->T_map_base, kAgreePosition, kAgreeAngle)
                            : IsNear(expected, result->T_map_base, kAgreeDepths * depth, kAgreeAngleWithout);
    if (agrees) hypothesis_->confirmations = previous->confirmations + 1;
  }
  return hypothesis_->confirmations >= kConfirmations;
}

// Farther than drift of odometry or map explains: the robot was kidnapped.
bool Tracker::IsJump(const Prediction& prediction, const TrackResult& result) const {
  constexpr double kJumpDistance = 1.0;  // m
  constexpr double kJumpAngle = DegreesToRadians(20.0);
  return prediction.from_odometry && !IsNear(prediction.T_map_base, result.T_map_base, kJumpDistance, kJumpAngle);
}

// Buildings repeat themselves: a far place that only looks alike shows little of what should be in view there.
bool Tracker::IsLookAlike(const Prediction& prediction, const TrackResult& result) const {
  constexpr double kLeastShare = 0.3;  // of the landmarks that should be in view; fitted
  return IsJump(prediction, result) &&
         result.inliers < kLeastShare * static_cast<double>(result.matches.visible.size());
}

// The keyframe that sees most of what this frame sees becomes the reference.
void Tracker::Adopt(const Map& map, const TrackResult& result) {
  const std::vector<KeyframeId> voted = VotedKeyframes(map, result.matches.landmarks, 1);
  if (voted.empty()) return;
  const Keyframe& reference = map.keyframes.At(voted.front());
  last_.reference = voted.front();
  last_.T_map_ref = reference.T_map_base;
  last_.T_ref_base = reference.T_map_base.Inverse() * result.T_map_base;
  reference_landmarks_ = CountWellObserved(map, reference.landmarks);
  visually_tracked_ = false;  // no motion leads here from the frame before
  localized_ = true;
}

}  // namespace planar_vslam
