#include "planar_vslam/map/map_union.h"

#include <algorithm>
#include <utility>

#include "planar_vslam/geometry/check.h"

namespace planar_vslam {
namespace {

template <class IdType>
IdType Raised(IdType id, std::uint32_t offset) {
  return id.valid() ? IdType{id.value + offset} : id;
}

Keyframe Raised(Keyframe keyframe, std::uint32_t keyframe_offset) {
  if (keyframe.odometry_link.has_value())
    keyframe.odometry_link->from = Raised(keyframe.odometry_link->from, keyframe_offset);
  for (MotionLink& link : keyframe.laser_links) link.from = Raised(link.from, keyframe_offset);
  std::fill(keyframe.landmarks.begin(), keyframe.landmarks.end(), LandmarkId{});  // they bring their observations
  return keyframe;
}

// The ids that were given out count as given out, whether what had them is there or not.
void GiveOutBelow(std::uint32_t next_keyframe, std::uint32_t next_landmark, Map* map) {
  map->next_keyframe_id = std::max(map->next_keyframe_id, next_keyframe);
  map->next_landmark_id = std::max(map->next_landmark_id, next_landmark);
}

}  // namespace

MapEdit AdditionOf(const Map& map, std::uint32_t keyframe_offset, std::uint32_t landmark_offset) {
  MapEdit edit;
  edit.reserve(map.keyframes.size() + map.landmarks.size());
  for (const auto& [id, keyframe] : map.keyframes)
    edit.emplace_back(AddKeyframe{Raised(id, keyframe_offset), Raised(keyframe, keyframe_offset)});
  for (const auto& [id, original] : map.landmarks) {
    Landmark landmark = original;
    landmark.created_by = Raised(landmark.created_by, keyframe_offset);
    for (Observation& o : landmark.observations) o.keyframe = Raised(o.keyframe, keyframe_offset);
    edit.emplace_back(AddLandmark{Raised(id, landmark_offset), std::move(landmark)});
  }
  return edit;
}

Map RenumberedAbove(const Map& below, const Map& map) {
  Map raised;
  raised.metric = map.metric;
  raised.octave_scales = map.octave_scales;
  raised = Apply(std::move(raised), AdditionOf(map, below.next_keyframe_id, below.next_landmark_id));
  GiveOutBelow(below.next_keyframe_id + map.next_keyframe_id, below.next_landmark_id + map.next_landmark_id, &raised);
  return raised;
}

Map UnionOf(const Map& lower, const Map& upper) {
  PV_CHECK(lower.metric == upper.metric && lower.octave_scales == upper.octave_scales, "maps of two kinds");
  Map both = Apply(lower, AdditionOf(upper, 0, 0));
  GiveOutBelow(upper.next_keyframe_id, upper.next_landmark_id, &both);
  return both;
}

}  // namespace planar_vslam
