#include "planar_vslam/backend/merge_maps.h"

#include <algorithm>
#include <utility>

#include "planar_vslam/backend/look_back.h"
#include "planar_vslam/map/map_union.h"
#include "planar_vslam/optimize/pose_graph.h"
#include "stages.h"

namespace planar_vslam {
namespace {

// Places found so far, by the one whose keyframe is nearest in the other map.
Rigid3 GuessFrom(const std::vector<SharedPlace>& places, const Rigid3& T_other_base) {
  const auto distance = [&](const SharedPlace& place) {
    return (place.T_other_base.translation - T_other_base.translation).norm();
  };
  const auto nearest = std::min_element(places.begin(), places.end(),
                                        [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
  return nearest->T_known_base * nearest->T_other_base.Inverse() * T_other_base;
}

std::vector<SharedPlace> ThoseThatAgree(const std::vector<SharedPlace>& found, const MapAlignment& alignment) {
  std::vector<SharedPlace> agree;
  for (const std::size_t k : alignment.places) agree.push_back(found[k]);
  return agree;
}

// Places that look alike are not all found where both are: an image votes for what is most like it. So they are asked
// for a second time.
std::optional<std::string> LooksLikeAnotherPlace(const PlaceSeeker& seeker, const Map& other,
                                                 const std::vector<SharedPlace>& places) {
  const std::vector<SharedPlace> elsewhere = seeker.FindElsewhere(other, places);
  std::vector<SharedPlace> both = places;
  both.insert(both.end(), elsewhere.begin(), elsewhere.end());
  const Expected<MapAlignment> alignment = Align(both);
  return alignment.ok() ? std::nullopt : std::optional(alignment.error().message);
}

std::vector<LoopTie> TiesAt(const std::vector<SharedPlace>& places) {
  constexpr double kPosition = 0.01;  // m, how well a recognised view tells where it was taken
  constexpr double kAngle = DegreesToRadians(0.2);
  std::vector<LoopTie> ties;
  for (const SharedPlace& place : places) {
    ties.push_back({place.known, place.keyframe, place.T_known_base,
                    Eigen::Vector3d(kPosition, kPosition, kAngle).cwiseAbs2().asDiagonal(),
                    place.by_laser ? TieSource::kLaser : TieSource::kLandmarks});
  }
  return ties;
}

// The keyframes from `first` on, moved, and with them the landmarks that they made.
MapEdit MoveFrom(const Map& map, KeyframeId first, const Rigid3& T_new_old) {
  std::vector<std::pair<KeyframeId, Rigid3>> poses;
  for (const auto& [id, keyframe] : map.keyframes)
    poses.emplace_back(id, id < first ? keyframe.T_map_base : T_new_old * keyframe.T_map_base);
  return MoveKeyframes(map, poses);
}

bool HasNearbyBelow(const Map& map, KeyframeId id, KeyframeId first, const MapperOptions& options) {
  const std::vector<KeyframeId> near = WithNearby(map, id, {}, options);
  return std::any_of(near.begin(), near.end(), [first](KeyframeId other) { return other < first; });
}

// Where keyframes of both stand side by side: landmarks fused, sweeps linked.
MapEdit TieTogether(Map* map, KeyframeId first, const MapperContext& context, const MergeProgress& progress) {
  MapEdit done;
  const std::vector<KeyframeId> ids = map->keyframes.Ids();
  for (std::size_t k = 0; k < ids.size(); ++k) {
    progress("joining", static_cast<long>(k + 1), static_cast<long>(ids.size()));
    if (ids[k] < first || !HasNearbyBelow(*map, ids[k], first, context.options)) continue;
    const MapEdit fused = FuseWithNeighbors(map, ids[k], context);
    const MapEdit linked = LinkByLaser(*map, ids[k], context.scan_match);
    *map = Apply(std::move(*map), linked);
    done.insert(done.end(), fused.begin(), fused.end());
    done.insert(done.end(), linked.begin(), linked.end());
  }
  return done;
}

void CountShared(MergedMap* merged) {
  for (const auto& [id, landmark] : merged->map.landmarks) {
    const bool by_both = landmark.observations.front().keyframe < merged->first_other &&
                         !(landmark.observations.back().keyframe < merged->first_other);
    merged->landmarks_shared += by_both ? 1 : 0;
  }
  for (auto it = merged->map.keyframes.From(merged->first_other); it != merged->map.keyframes.end(); ++it) {
    for (const MotionLink& link : it->second.laser_links)
      merged->laser_links += link.from < merged->first_other ? 1 : 0;
  }
}

}  // namespace

Expected<MapOverlap> FindOverlap(const PlaceSeeker& seeker, const Map& other, const MergeProgress& progress) {
  std::vector<SharedPlace> found;
  long done = 0;
  for (const auto& [id, keyframe] : other.keyframes) {
    if (std::optional<SharedPlace> place = seeker.Find(id, keyframe)) found.push_back(std::move(*place));
    progress("looking for places", ++done, static_cast<long>(other.keyframes.size()));
  }
  return OverlapOf(seeker, other, found, progress);
}

Expected<MapOverlap> OverlapOf(const PlaceSeeker& seeker, const Map& other, const std::vector<SharedPlace>& found,
                               const MergeProgress& progress) {
  Expected<MapAlignment> alignment = Align(found);
  if (!alignment.ok()) return alignment.error();
  const std::vector<SharedPlace> sure = ThoseThatAgree(found, *alignment);
  if (const std::optional<std::string> against = LooksLikeAnotherPlace(seeker, other, sure)) return Error{*against};
  std::vector<SharedPlace> all;
  std::vector<PlaceTest> tests;
  auto next = sure.begin();
  long done = 0;
  for (const auto& [id, keyframe] : other.keyframes) {
    progress("comparing", ++done, static_cast<long>(other.keyframes.size()));
    PlaceTest test = seeker.TestAt(id, keyframe, GuessFrom(sure, keyframe.T_map_base));
    const bool is_sure = next != sure.end() && next->keyframe == id;
    if (is_sure) {
      all.push_back(*next++);
    } else if (test.place.has_value()) {
      all.push_back(std::move(*test.place));
    }
    test.place.reset();
    tests.push_back(std::move(test));
  }
  if (const std::optional<std::string> against = Contradiction(tests)) return Error{*against};
  Expected<MapAlignment> by_all = Align(all);
  if (!by_all.ok()) return by_all.error();
  MapOverlap overlap{std::move(by_all).value(), {}};
  overlap.places = ThoseThatAgree(all, overlap.alignment);
  return overlap;
}

Expected<JoinedMap> JoinAt(const Map& united, KeyframeId first, const MapOverlap& overlap, const MapperContext& context,
                           const MergeProgress& progress) {
  Map map = Apply(united, MoveFrom(united, first, overlap.alignment.T_known_other));
  const auto poses = SolvePoseGraph(map, TiesOf(map, context.model), TiesAt(overlap.places), context.model.planar);
  if (!poses.ok()) return Error{"pose graph: " + poses.error().message};
  const MapEdit moved = MoveKeyframes(map, *poses);
  map = Apply(std::move(map), moved);
  MapEdit structure;
  for (const SharedPlace& place : overlap.places) {
    const MapEdit joined = JoinLandmarks(map, place.keyframe, place.matches);
    map = Apply(std::move(map), joined);
    structure.insert(structure.end(), joined.begin(), joined.end());
  }
  const MapEdit tied = TieTogether(&map, first, context, progress);
  structure.insert(structure.end(), tied.begin(), tied.end());
  progress("adjusting", 0, 1);
  Expected<AdjustedMap> adjusted = AdjustWholeMap(map, context.model);
  progress("adjusting", 1, 1);
  if (!adjusted.ok()) return Error{"bundle adjustment: " + adjusted.error().message};
  const MapEdit& dropped = adjusted->correction.structure;
  structure.insert(structure.end(), dropped.begin(), dropped.end());
  return JoinedMap{std::move(adjusted->map), std::move(structure), std::move(adjusted->bundle)};
}

Expected<MergedMap> MergeMaps(const std::shared_ptr<const Map>& known, const Map& other, const MapperContext& context,
                              const MergeProgress& progress) {
  const PlaceSeeker seeker(known, context);
  const Map raised = RenumberedAbove(*known, other);
  Expected<MapOverlap> overlap = FindOverlap(seeker, raised, progress);
  if (!overlap.ok()) return overlap.error();
  const KeyframeId first_other{known->next_keyframe_id};
  Expected<JoinedMap> joined = JoinAt(UnionOf(*known, raised), first_other, *overlap, context, progress);
  if (!joined.ok()) return joined.error();
  MergedMap merged;
  merged.map = std::move(joined->map);
  merged.overlap = std::move(overlap).value();
  merged.first_other = first_other;
  merged.bundle = std::move(joined->bundle);
  CountShared(&merged);
  return merged;
}

}  // namespace planar_vslam
