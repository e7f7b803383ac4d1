#include "planar_vslam/map/distance_driven.h"

namespace planar_vslam {

DistanceDriven::DistanceDriven(const Map& map) : map_(map), driven_(map.next_keyframe_id, 0.0) {
  double driven = 0.0;
  const Keyframe* last = nullptr;
  for (const auto& [id, keyframe] : map.keyframes) {
    if (last != nullptr) driven += (keyframe.T_map_base.translation - last->T_map_base.translation).norm();
    driven_[id.value] = driven;
    last = &keyframe;
  }
}

// Seen before and, a long way on, again.
bool DistanceDriven::HasReturned(const Landmark& landmark) const {
  for (std::size_t k = 1; k < landmark.observations.size(); ++k) {
    if (Between(landmark.observations[k - 1].keyframe, landmark.observations[k].keyframe) > kReturn) return true;
  }
  return false;
}

bool DistanceDriven::HasReturned(const Keyframe& keyframe) const {
  int seen = 0, returned = 0;
  for (const LandmarkId id : keyframe.landmarks) {
    if (!id.valid()) continue;
    ++seen;
    returned += HasReturned(map_.landmarks.At(id)) ? 1 : 0;
  }
  return 2 * returned > seen;
}

}  // namespace planar_vslam
