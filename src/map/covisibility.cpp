#include <algorithm>

#include "planar_vslam/map/map.h"

namespace planar_vslam {

std::vector<CovisibleKeyframe> CovisibleKeyframes(const Map& map, KeyframeId id, int min_shared) {
  const Keyframe* keyframe = map.keyframes.Find(id);
  if (keyframe == nullptr) return {};

  // Observations are ascending by keyframe.
  std::uint32_t first = id.value, last = id.value;
  for (const LandmarkId landmark : keyframe->landmarks) {
    if (!landmark.valid()) continue;
    const std::vector<Observation>& observations = map.landmarks.At(landmark).observations;
    first = std::min(first, observations.front().keyframe.value);
    last = std::max(last, observations.back().keyframe.value);
  }
  std::vector<int> shared(last - first + 1, 0);  // by id, from the first on
  for (const LandmarkId landmark : keyframe->landmarks) {
    if (!landmark.valid()) continue;
    for (const Observation& o : map.landmarks.At(landmark).observations) ++shared[o.keyframe.value - first];
  }
  shared[id.value - first] = 0;

  std::vector<CovisibleKeyframe> covisible;
  for (std::uint32_t other = first; other <= last; ++other) {
    const int count = shared[other - first];
    if (count > 0 && count >= min_shared) covisible.push_back({KeyframeId{other}, count});
  }
  std::stable_sort(covisible.begin(), covisible.end(),
                   [](const CovisibleKeyframe& a, const CovisibleKeyframe& b) { return a.shared > b.shared; });
  return covisible;
}

}  // namespace planar_vslam
