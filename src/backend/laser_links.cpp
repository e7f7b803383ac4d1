#include <algorithm>
#include <cmath>

#include "stages.h"

namespace planar_vslam {
namespace {

// The latest earlier keyframe with a sweep, and the oldest one near enough to have seen the same surfaces: it keeps
// errors from adding up, and closes small loops.
std::vector<KeyframeId> LaserReferences(const Map& map, KeyframeId newest) {
  constexpr double kNear = 1.0;  // m
  constexpr double kNearAngle = DegreesToRadians(60.0);
  const Rigid3& T_map_newest = map.keyframes.At(newest).T_map_base;
  const Rigid2 T_newest_map = ProjectToPlane(T_map_newest).Inverse();
  KeyframeId oldest;
  for (const KeyframeId id : map.bases.Around(T_map_newest.translation, kNear)) {
    const Keyframe& keyframe = map.keyframes.At(id);
    if (keyframe.sweeps.empty() || !(id < newest) || !(id < oldest)) continue;
    const Rigid2 T_newest_other = T_newest_map * ProjectToPlane(keyframe.T_map_base);
    if (T_newest_other.translation.norm() < kNear && std::abs(T_newest_other.angle) < kNearAngle) oldest = id;
  }
  std::vector<KeyframeId> references;
  if (oldest.valid()) references.push_back(oldest);
  for (const auto* latest = map.keyframes.Before(newest); latest != nullptr;
       latest = map.keyframes.Before(latest->first)) {
    if (latest->second.sweeps.empty()) continue;
    if (latest->first != oldest) references.push_back(latest->first);
    break;
  }
  return references;
}

}  // namespace

PreparedScan OwnSweep(const Keyframe& keyframe, const ScanMatchOptions& options) {
  const LaserSweep& sweep = keyframe.sweeps.front();
  return PrepareScan(*sweep.scan, Embed3(sweep.T_keyframe_base) * sweep.T_base_laser, options);
}

std::vector<KeyframeId> NearestWithSweep(const Map& map, const Rigid3& T_map_base, double distance, std::size_t limit) {
  const auto from_there = [&](KeyframeId id) {
    return (map.keyframes.At(id).T_map_base.translation - T_map_base.translation).head<2>().norm();
  };
  std::vector<KeyframeId> near = map.bases.Around(T_map_base.translation, distance);
  near.erase(
      std::remove_if(near.begin(), near.end(),
                     [&](KeyframeId id) { return map.keyframes.At(id).sweeps.empty() || from_there(id) >= distance; }),
      near.end());
  std::sort(near.begin(), near.end());
  std::stable_sort(near.begin(), near.end(), [&](KeyframeId a, KeyframeId b) { return from_there(a) < from_there(b); });
  if (near.size() > limit) near.resize(limit);
  return near;
}

MapEdit LinkByLaser(const Map& map, KeyframeId newest, const ScanMatchOptions& options) {
  const Keyframe& current = map.keyframes.At(newest);
  if (!options.enabled || !map.metric || current.sweeps.empty()) return {};
  constexpr double kLargestTurn = DegreesToRadians(8.0);  // beyond what surfaces seen from two places settle on
  const PreparedScan prepared = OwnSweep(current, options);
  AddLaserLinks step{newest, {}};
  for (const KeyframeId id : LaserReferences(map, newest)) {
    const Keyframe& reference = map.keyframes.At(id);
    const Rigid2 guess = ProjectToPlane(reference.T_map_base).Inverse() * ProjectToPlane(current.T_map_base);
    const std::optional<ScanMatch> match = MatchScans(OwnSweep(reference, options), prepared, guess, options);
    if (!match.has_value()) continue;
    const Rigid2 correction = guess.Inverse() * match->T_reference_current;
    if (correction.translation.norm() > options.max_offset || std::abs(correction.angle) > kLargestTurn) continue;
    step.links.push_back({id, MotionOf(*match, SecondsBetween(reference.stamp, current.stamp))});
  }
  return {step};
}

Map LinkedByLaser(Map map, const ScanMatchOptions& options) {
  for (const KeyframeId id : map.keyframes.Ids()) {
    const MapEdit links = LinkByLaser(map, id, options);
    map = Apply(std::move(map), links);
  }
  return map;
}

}  // namespace planar_vslam
