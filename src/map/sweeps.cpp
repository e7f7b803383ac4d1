#include "sweeps.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace planar_vslam {
namespace {

// A pass leaves a sweep each 5 cm, six within reach of one: two passes stay, and what the older one saw of somebody
// walking by, the other clears.
constexpr double kDistance = 0.15;  // m
constexpr double kAngle = DegreesToRadians(20.0);
constexpr double kVisit = 30.0;  // s: sweeps closer in time than that are of one pass, or of a robot that stood
constexpr std::size_t kEnough = 6;
constexpr double kAround = 2.0;  // m, within which keyframes are looked for

// Of the sweeps like one.
struct Alike {
  std::size_t count = 0;
  std::optional<std::pair<KeyframeId, std::size_t>> oldest;  // that may go: keyframe, and position in its sweeps
  Timestamp stamp;                                           // of that
};

bool AreAlike(const LaserSweep& sweep, const Rigid2& T_sweep_map, const LaserSweep& other, const Rigid2& T_map_other) {
  if (std::abs(SecondsBetween(sweep.scan->stamp, other.scan->stamp)) < kVisit) return false;
  const Rigid2 T_sweep_other = T_sweep_map * T_map_other;
  return T_sweep_other.translation.norm() < kDistance && std::abs(T_sweep_other.angle) < kAngle;
}

// Among the sweeps of `around`.
Alike FindAlike(const Map& map, const std::vector<KeyframeId>& around, const LaserSweep& sweep,
                const Rigid2& T_map_sweep) {
  Alike alike;
  const Rigid2 T_sweep_map = T_map_sweep.Inverse();
  for (const KeyframeId id : around) {
    const Keyframe& keyframe = map.keyframes.At(id);
    const Rigid2 T_map_keyframe = ProjectToPlane(keyframe.T_map_base);
    for (std::size_t k = 0; k < keyframe.sweeps.size(); ++k) {
      const LaserSweep& other = keyframe.sweeps[k];
      if (!AreAlike(sweep, T_sweep_map, other, T_map_keyframe * other.T_keyframe_base)) continue;
      ++alike.count;
      if (k == 0 || (alike.oldest.has_value() && !(other.scan->stamp < alike.stamp))) continue;
      alike.oldest = {id, k};
      alike.stamp = other.scan->stamp;
    }
  }
  return alike;
}

}  // namespace

std::vector<LaserSweep> ThinSweeps(Map* map, KeyframeId erased) {
  const Keyframe keyframe = map->keyframes.At(erased);
  const Rigid2 T_map_keyframe = ProjectToPlane(keyframe.T_map_base);
  std::vector<KeyframeId> around = map->bases.Around(keyframe.T_map_base.translation, kAround);
  around.erase(std::remove(around.begin(), around.end(), erased), around.end());
  std::sort(around.begin(), around.end());
  std::vector<LaserSweep> kept;
  for (const LaserSweep& sweep : keyframe.sweeps) {
    const Alike alike = FindAlike(*map, around, sweep, T_map_keyframe * sweep.T_keyframe_base);
    if (alike.count >= kEnough) {
      if (!alike.oldest.has_value() || !(alike.stamp < sweep.scan->stamp)) continue;
      std::vector<LaserSweep>& sweeps = map->keyframes.Edit(alike.oldest->first).sweeps;
      sweeps.erase(sweeps.begin() + static_cast<std::ptrdiff_t>(alike.oldest->second));
    }
    kept.push_back(sweep);
  }
  return kept;
}

KeyframeId HomeForSweeps(const Map& map, KeyframeId erased) {
  constexpr double kBeside = 1.0;  // m, and more than from one keyframe to the next
  const Eigen::Vector3d& p_map = map.keyframes.At(erased).T_map_base.translation;
  const auto distance = [&](KeyframeId id) {
    return (map.keyframes.At(id).T_map_base.translation - p_map).head<2>().norm();
  };
  const auto* before = map.keyframes.Before(erased);
  KeyframeId home = before != nullptr ? before->first : map.keyframes.From(KeyframeId{erased.value + 1})->first;
  if (distance(home) < kBeside) return home;
  for (const KeyframeId id : map.bases.Around(p_map, kAround)) {
    if (id != erased && distance(id) < distance(home)) home = id;
  }
  return home;
}

}  // namespace planar_vslam
