#include <algorithm>

#include "planar_vslam/map/map.h"

namespace planar_vslam {

std::vector<CovisibleKeyframe> CovisibleKeyframes(const Map& map, KeyframeId id, int min_shared) {
  const Keyframe* keyframe = map.keyframes.Find(id);
  if (keyframe == nullptr) return {};

  std::vector<KeyframeId> sightings;  // one entry per landmark shared
  for (const LandmarkId landmark : keyframe->landmarks) {
    if (!landmark.valid()) continue;
    for (const Observation& o : map.landmarks.At(landmark).observations) {
      if (o.keyframe != id) sightings.push_back(o.keyframe);
    }
  }
  std::sort(sightings.begin(), sightings.end());

  std::vector<CovisibleKeyframe> covisible;
  for (auto it = sightings.begin(); it != sightings.end();) {
    const auto next = std::upper_bound(it, sightings.end(), *it);
    const int shared = static_cast<int>(next - it);
    if (shared >= min_shared) covisible.push_back({*it, shared});
    it = next;
  }
  std::stable_sort(covisible.begin(), covisible.end(),
                   [](const CovisibleKeyframe& a, const CovisibleKeyframe& b) { return a.shared > b.shared; });
  return covisible;
}

}  // namespace planar_vslam
