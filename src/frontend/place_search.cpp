#include "planar_vslam/frontend/place_search.h"

#include <algorithm>
#include <utility>

#include "planar_vslam/map/queries.h"
#include "pose_difference.h"

namespace planar_vslam {
namespace {

// Two poses of one place, where no odometry leads from one to the other: the error of PnP grows with the distance.
constexpr double kSamePlaceDepths = 0.2;                        // of the distance to what is seen
constexpr double kRivalAngle = DegreesToRadians(10.0);          // of one view
constexpr double kStandingStillAngle = DegreesToRadians(15.0);  // of two, between which the robot may have moved

double Depth(const Map& map, const CameraView& view, const Placement& placement) {
  return MedianDepth(map, placement.matches.landmarks, placement.T_map_base * view.T_base_camera);
}

}  // namespace

std::optional<Placement> PlaceSearch::FindAnywhere(const Map& map, const CameraView& view) {
  for (const KeyframeId keyframe : Resembling(map, view)) {
    std::optional<Placement> placement = Recognize(map, view, keyframe);
    if (placement.has_value() && placement->matches.count >= min_inliers_) return placement;
  }
  return std::nullopt;
}

std::optional<Placement> PlaceSearch::FindConfirmed(const Map& map, const CameraView& view,
                                                    const PlaceExpectation& expected) {
  std::optional<Hypothesis> previous;
  previous.swap(hypothesis_);
  std::optional<Placement> best = Best(map, view, Candidates(map, view, expected, previous));
  if (!best.has_value()) return std::nullopt;
  hypothesis_ = Hypothesis{best->T_map_base, 1};
  if (previous.has_value()) {
    const bool agrees = expected.T_last_now.has_value()
                            ? IsNear(previous->T_map_base * *expected.T_last_now, best->T_map_base,
                                     PlaceLimits::kAgreeDistance, PlaceLimits::kTrackerAgreeAngle)
                            : IsNear(previous->T_map_base, best->T_map_base, kSamePlaceDepths * Depth(map, view, *best),
                                     kStandingStillAngle);
    if (agrees) hypothesis_->confirmations = previous->confirmations + 1;
  }
  if (hypothesis_->confirmations < PlaceLimits::kViewsInARow) return std::nullopt;
  return best;
}

std::vector<KeyframeId> PlaceSearch::Resembling(const Map& map, const CameraView& view) {
  index_.Update(map);
  return index_.Resembling(*view.features, PlaceLimits::kTriedAnywhere);
}

// Where the hypothesis leads; else around the expected pose; else anywhere.
std::vector<KeyframeId> PlaceSearch::Candidates(const Map& map, const CameraView& view,
                                                const PlaceExpectation& expected,
                                                const std::optional<Hypothesis>& previous) {
  if (!previous.has_value() && !expected.T_map_base.has_value()) return Resembling(map, view);
  Rigid3 T_map_base = previous.has_value() ? previous->T_map_base : *expected.T_map_base;
  if (previous.has_value() && expected.T_last_now.has_value()) T_map_base = T_map_base * *expected.T_last_now;
  return NearbyKeyframes(map, T_map_base * view.T_base_camera, PlaceLimits::kReach, PlaceLimits::kTrackerReachAngle,
                         PlaceLimits::kTried);
}

std::optional<Placement> PlaceSearch::Best(const Map& map, const CameraView& view,
                                           const std::vector<KeyframeId>& candidates) {
  std::vector<Placement> found;
  seen_.clear();
  for (const KeyframeId keyframe : candidates) {
    std::optional<Placement> placement = Recognize(map, view, keyframe);
    if (!placement.has_value()) continue;
    seen_.push_back(*placement);
    if (placement->matches.count >= min_inliers_) found.push_back(std::move(*placement));
  }
  if (found.empty()) return std::nullopt;
  const Placement& best = *std::max_element(found.begin(), found.end(), [](const Placement& a, const Placement& b) {
    return a.matches.count < b.matches.count;
  });
  const double same_place = kSamePlaceDepths * Depth(map, view, best);
  const bool unrivalled = std::all_of(found.begin(), found.end(), [&](const Placement& other) {
    return other.matches.count < PlaceLimits::kRivalShare * best.matches.count ||
           IsNear(best.T_map_base, other.T_map_base, same_place, kRivalAngle);
  });
  if (!unrivalled) return std::nullopt;
  return best;
}

}  // namespace planar_vslam
