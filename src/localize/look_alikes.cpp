#include "planar_vslam/localize/look_alikes.h"

#include <algorithm>

#include "planar_vslam/localize/floor_votes.h"
#include "planar_vslam/map/queries.h"

namespace planar_vslam {
namespace {

// The map's own views where these were taken, as views from `T_map_base`.
std::vector<SightView> AsMapped(const Map& map, const Rigid2& T_map_base, const std::vector<SightView>& views) {
  constexpr double kReach = 1.5;  // m, and...
  constexpr double kReachAngle = DegreesToRadians(40.0);
  std::vector<SightView> mapped;
  std::vector<KeyframeId> asked;
  for (const SightView& view : views) {
    const Rigid3 T_map_camera = Embed3(T_map_base * view.T_now_base) * view.view.T_base_camera;
    for (const KeyframeId id : NearbyKeyframes(map, T_map_camera, kReach, kReachAngle, 1)) {
      if (std::find(asked.begin(), asked.end(), id) != asked.end()) continue;
      asked.push_back(id);
      const Keyframe& keyframe = map.keyframes.At(id);
      SightView as_mapped{T_map_base.Inverse() * ProjectToPlane(keyframe.T_map_base), view.view};
      as_mapped.view.features = keyframe.features;
      as_mapped.view.T_base_camera = keyframe.T_base_camera;
      mapped.push_back(as_mapped);
    }
  }
  return mapped;
}

}  // namespace

std::optional<double> LookAlikeShare(const LandmarkTable& table, const Map& map, const Rigid2& T_map_base,
                                     const std::vector<SightView>& views) {
  constexpr double kElsewhere = 2.0;        // m, from where the same things are not seen the same way
  constexpr SightWindow kWindow{0.0, 6.0};  // px, that a landmark may lie off
  constexpr std::size_t kVoted = 60;
  constexpr double kLeastInView = 30.0;  // a view
  const std::vector<SightView> mapped = AsMapped(map, T_map_base, views);
  if (mapped.empty()) return std::nullopt;
  std::vector<std::vector<LikelyMatch>> matches;
  matches.reserve(mapped.size());
  for (const SightView& view : mapped) matches.push_back(FindLikelyMatches(table, *view.view.features));
  double largest = 0.0;
  for (const Rigid2& place : VotedPlaces(table, mapped, matches, kVoted)) {
    if ((place.translation - T_map_base.translation).norm() < kElsewhere) continue;
    const Rigid2 settled = Settle(table, place, mapped).T_map_base;
    if ((settled.translation - T_map_base.translation).norm() < kElsewhere) continue;
    const Agreement agreement = Compare(table, settled, mapped, kWindow);
    if (agreement.visible >= kLeastInView * static_cast<double>(mapped.size()))
      largest = std::max(largest, agreement.share());
  }
  return largest;
}

std::optional<double> SightMap::LookAlikeShareAt(const Rigid2& T_map_base, const std::vector<SightView>& views) {
  constexpr double kSame = 1.0;  // m, and...
  constexpr double kSameAngle = DegreesToRadians(30.0);
  for (const Answer& answer : answers_) {
    const Rigid2 off = answer.T_map_base.Inverse() * T_map_base;
    const bool same = off.translation.norm() <= kSame && std::abs(off.angle) <= kSameAngle;
    if (same && answer.views >= views.size()) return answer.share;
  }
  answers_.push_back({T_map_base, views.size(), LookAlikeShare(table_, *map_, T_map_base, views)});
  return answers_.back().share;
}

}  // namespace planar_vslam
