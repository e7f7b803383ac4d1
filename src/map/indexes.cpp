#include "indexes.h"

#include <algorithm>

namespace planar_vslam {

std::vector<KeyframeId> LinkedFrom(const Keyframe& keyframe) {
  std::vector<KeyframeId> from;
  if (keyframe.odometry_link.has_value()) from.push_back(keyframe.odometry_link->from);
  for (const MotionLink& link : keyframe.laser_links) from.push_back(link.from);
  std::sort(from.begin(), from.end());
  from.erase(std::unique(from.begin(), from.end()), from.end());
  return from;
}

void IndexLink(Map* map, KeyframeId from, KeyframeId to) {
  const Keyframe* source = map->keyframes.Find(from);
  if (source == nullptr) return;
  const Keyframe* holder = map->keyframes.Find(to);
  bool holds = false;
  if (holder != nullptr) {
    const std::vector<KeyframeId> linked_from = LinkedFrom(*holder);
    holds = std::binary_search(linked_from.begin(), linked_from.end(), from);
  }
  if (std::binary_search(source->linked_by.begin(), source->linked_by.end(), to) == holds) return;
  std::vector<KeyframeId>& linked_by = map->keyframes.Edit(from).linked_by;
  const auto at = std::lower_bound(linked_by.begin(), linked_by.end(), to);
  if (holds) {
    linked_by.insert(at, to);
  } else {
    linked_by.erase(at);
  }
}

void IndexPlace(Map* map, KeyframeId id) {
  const Keyframe& keyframe = map->keyframes.At(id);
  map->bases.Add(id, keyframe.T_map_base.translation);
  map->cameras.Add(id, keyframe.T_map_camera().translation);
}

void IndexMove(Map* map, KeyframeId id, const Rigid3& T_map_base_before, const Rigid3& T_map_camera_before) {
  const Keyframe& keyframe = map->keyframes.At(id);
  map->bases.Move(id, T_map_base_before.translation, keyframe.T_map_base.translation);
  map->cameras.Move(id, T_map_camera_before.translation, keyframe.T_map_camera().translation);
}

void DropPlace(Map* map, KeyframeId id) {
  const Keyframe& keyframe = map->keyframes.At(id);
  map->bases.Remove(id, keyframe.T_map_base.translation);
  map->cameras.Remove(id, keyframe.T_map_camera().translation);
}

void IndexPlaces(Map* map) {
  map->bases = map->cameras = KeyframeGrid();
  for (const auto& [id, keyframe] : map->keyframes) IndexPlace(map, id);
}

void RebuildIndexes(Map* map) {
  const std::vector<KeyframeId> ids = map->keyframes.Ids();
  for (const KeyframeId id : ids) map->keyframes.Edit(id).linked_by.clear();
  for (const KeyframeId id : ids) {
    for (const KeyframeId from : LinkedFrom(map->keyframes.At(id))) IndexLink(map, from, id);
  }
  IndexPlaces(map);
}

}  // namespace planar_vslam
