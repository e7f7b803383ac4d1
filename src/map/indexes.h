#pragma once
// What a map knows twice so that it is found at once: which keyframes hold links from one, and where they stand.
#include "planar_vslam/map/map.h"

namespace planar_vslam {

// Puts `linked_by` of `from` in step with the links that `to` holds, both of which may be gone.
void IndexLink(Map* map, KeyframeId from, KeyframeId to);

// Those of map.bases and map.cameras anew.
void IndexPlaces(Map* map);
// After the keyframe has been added, or moved from where it was, or before it is erased.
void IndexPlace(Map* map, KeyframeId id);
void IndexMove(Map* map, KeyframeId id, const Rigid3& T_map_base_before, const Rigid3& T_map_camera_before);
void DropPlace(Map* map, KeyframeId id);
// The keyframes this one holds links from, ascending, each once.
std::vector<KeyframeId> LinkedFrom(const Keyframe& keyframe);

}  // namespace planar_vslam
