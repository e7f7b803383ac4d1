#include "planar_vslam/map/distance_driven.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace planar_vslam {

double DistanceDriven::Follow(const Map& map, KeyframeId first) {
  const std::size_t kept = std::min<std::size_t>(first.value, driven_.size());
  const std::vector<double> before(driven_.begin() + static_cast<std::ptrdiff_t>(kept), driven_.end());
  driven_.resize(kept);
  driven_.resize(map.next_keyframe_id, std::numeric_limits<double>::quiet_NaN());
  const auto* last = map.keyframes.Before(first);
  double driven = last != nullptr ? driven_[last->first.value] : 0.0;
  double least = 0.0, most = 0.0;  // of how much further the robot has driven to a keyframe now
  for (auto it = map.keyframes.From(first); it != map.keyframes.end(); ++it) {
    const auto& [id, keyframe] = *it;
    if (last != nullptr) driven += (keyframe.T_map_base.translation - last->second.T_map_base.translation).norm();
    driven_[id.value] = driven;
    last = &*it;
    const std::size_t at = id.value - first.value;
    if (at >= before.size() || std::isnan(before[at])) continue;
    least = std::min(least, driven - before[at]);
    most = std::max(most, driven - before[at]);
  }
  return most - least;
}

bool DistanceDriven::HasReturned(const Map& map, const Keyframe& keyframe, double* slack) const {
  int seen = 0, returned = 0;
  for (const LandmarkId id : keyframe.landmarks) {
    if (!id.valid()) continue;
    ++seen;
    const std::vector<Observation>& observations = map.landmarks.At(id).observations;
    for (std::size_t k = 1; k < observations.size(); ++k) {  // seen before and, a long way on, again?
      const double way = Between(observations[k - 1].keyframe, observations[k].keyframe);
      if (slack != nullptr) *slack = std::min(*slack, std::abs(way - kReturn));
      if (!(way > kReturn)) continue;
      ++returned;
      break;
    }
  }
  return 2 * returned > seen;
}

}  // namespace planar_vslam
