#include <algorithm>

#include "stages.h"

namespace planar_vslam {
namespace {

constexpr std::uint32_t kRecentKeyframes = 3;  // a landmark is on probation this long
constexpr std::size_t kProbationObservations = 3;
constexpr std::size_t kOtherObservers = 3;  // others that must see a landmark for it to count as redundant

// Whether at least kOtherObservers other keyframes see the landmark at the same or a finer scale.
bool SeenElsewhere(const Map& map, const Landmark& landmark, KeyframeId keyframe, int octave) {
  std::size_t others = 0;
  for (const Observation& o : landmark.observations) {
    if (o.keyframe == keyframe) continue;
    if (map.keyframes.At(o.keyframe).features->keypoints[o.keypoint].octave <= octave + 1) ++others;
    if (others >= kOtherObservers) return true;
  }
  return false;
}

// Whether more than `redundancy` of the landmarks are seen elsewhere too; settled as soon as too many are not.
bool IsRedundant(const Map& map, KeyframeId id, const Keyframe& keyframe, double redundancy) {
  const auto counted = std::count_if(keyframe.landmarks.begin(), keyframe.landmarks.end(),
                                     [](LandmarkId landmark) { return landmark.valid(); });
  auto redundant = counted;  // at most
  for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    if (!keyframe.landmarks[i].valid()) continue;
    const Landmark& landmark = map.landmarks.At(keyframe.landmarks[i]);
    if (landmark.observations.size() > kOtherObservers &&
        SeenElsewhere(map, landmark, id, keyframe.features->keypoints[i].octave)) {
      continue;
    }
    --redundant;
    if (static_cast<double>(redundant) <= redundancy * static_cast<double>(counted)) return false;
  }
  return static_cast<double>(redundant) > redundancy * static_cast<double>(counted);
}

}  // namespace

MapEdit CullRecentLandmarks(const Map& map, KeyframeId newest, const MapperOptions& options) {
  EraseLandmarks erase;
  for (auto it = map.landmarks.end(); it != map.landmarks.begin();) {
    const auto& [id, landmark] = *--it;
    const std::uint32_t age = newest.value - landmark.created_by.value;
    if (age > kRecentKeyframes) break;  // each keyframe creates its landmarks after those of the keyframes before
    const bool rarely_found =
        static_cast<double>(landmark.found) < options.min_found_ratio * landmark.predicted_visible;
    const bool not_confirmed = age >= kRecentKeyframes && landmark.observations.size() < kProbationObservations;
    if (rarely_found || not_confirmed) erase.ids.push_back(id);
  }
  std::reverse(erase.ids.begin(), erase.ids.end());
  return {erase};
}

MapEdit CullKeyframes(const Map& map, KeyframeId newest, const MapperOptions& options,
                      std::vector<CulledKeyframe>* culled) {
  MapEdit edit;
  const KeyframeId first = map.keyframes.begin()->first;
  const std::optional<MotionLink>& newest_link = map.keyframes.At(newest).odometry_link;
  for (const CovisibleKeyframe& neighbor : CovisibleKeyframes(map, newest, options.min_shared)) {
    const KeyframeId id = neighbor.id;
    if (id == first || id.value + 1 >= newest.value || (newest_link.has_value() && newest_link->from == id)) continue;
    const Keyframe& keyframe = map.keyframes.At(id);
    if (!IsRedundant(map, id, keyframe, options.redundancy)) continue;
    const auto beside = [&keyframe](const auto& entry) {
      const Keyframe& other = entry.second;
      return CulledKeyframe::Neighbor{entry.first, other.T_map_base.Inverse() * keyframe.T_map_base,
                                      other.T_base_camera};
    };
    culled->push_back({id, beside(*map.keyframes.Before(id)), beside(*map.keyframes.After(id)), keyframe.T_base_camera,
                       keyframe.moment});
    edit.emplace_back(EraseKeyframe{id});
    break;  // one a keyframe: the next one's redundancy depends on this one being gone
  }
  return edit;
}

}  // namespace planar_vslam
