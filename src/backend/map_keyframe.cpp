#include "planar_vslam/backend/map_keyframe.h"

#include <set>

#include "planar_vslam/map/queries.h"
#include "stages.h"

namespace planar_vslam {
namespace {

// The tracker worked on an older map: matches to landmarks that are gone since do not count.
void DropMissingLandmarks(const Map& map, Keyframe* keyframe) {
  std::set<LandmarkId> seen;
  for (LandmarkId& id : keyframe->landmarks) {
    if (id.valid() && (!map.landmarks.Contains(id) || !seen.insert(id).second)) id = LandmarkId{};
  }
}

SetOffFloor OffFloorSince(const Map& map, Timestamp since, KeyframeId session_begin) {
  SetOffFloor off;
  for (auto it = map.keyframes.end(); it != map.keyframes.begin();) {
    const auto& [id, keyframe] = *--it;
    if (id < session_begin || keyframe.stamp < since) break;  // stamps of a session ascend
    off.ids.push_back(id);
  }
  return off;
}

// The keyframe with its matches, odometry and sweeps, and what was seen since the one before.
MapEdit Arrival(const Map& map, KeyframeId id, const KeyframeProposal& proposal) {
  Keyframe keyframe = proposal.keyframe;
  DropMissingLandmarks(map, &keyframe);
  if (proposal.odometry.has_value()) {
    keyframe.odometry_link = MotionLink{std::prev(map.keyframes.end())->first, *proposal.odometry};
  }
  MapEdit arrival{proposal.sightings, AddKeyframe{id, std::move(keyframe)}};
  arrival.insert(arrival.end(), proposal.sweeps.begin(), proposal.sweeps.end());
  if (proposal.off_floor_since.has_value()) {
    arrival.emplace_back(OffFloorSince(map, *proposal.off_floor_since, proposal.session_begin));
  }
  return arrival;
}

int Triangulate(Map* map, KeyframeId id, const MapperContext& context) {
  const MapperOptions& o = context.options;
  const MapEdit edit = TriangulateWith(
      *map, id, Neighbors(*map, id, o.triangulation_neighbors, o.link_neighbors, o.min_shared), context);
  *map = Apply(std::move(*map), edit);
  return static_cast<int>(edit.size());
}

}  // namespace

MappingOutcome MapKeyframe(const Map& snapshot, const KeyframeProposal& proposal, const MapperContext& context,
                           const std::atomic<bool>* hurry) {
  MappingReport report;
  StageClock clock(&report.times);
  Map map = snapshot;
  clock.End("map.copy");
  const KeyframeId id{map.next_keyframe_id};
  report.keyframe = id;
  const MapEdit arrival = Arrival(map, id, proposal);
  map = Apply(std::move(map), arrival);
  clock.End("map.arrival");
  const MapEdit laser = LinkByLaser(map, id, context.scan_match);
  map = Apply(std::move(map), laser);
  report.laser_links = static_cast<int>(map.keyframes.At(id).laser_links.size());
  clock.End("map.laser_links");

  const std::size_t before = map.landmarks.size();
  const MapEdit recent = CullRecentLandmarks(map, id, context.options);
  map = Apply(std::move(map), recent);
  report.landmarks_culled = static_cast<int>(before - map.landmarks.size());
  clock.End("map.cull_landmarks");
  report.triangulated = Triangulate(&map, id, context);
  clock.End("map.triangulate");
  report.fused = static_cast<int>(FuseWithNeighbors(&map, id, context).size());
  clock.End("map.fuse");

  const BundleResult bundle =
      AdjustBundle(map, LocalRequest(map, id, context.options), context.model, BundleSolver::kSchur, hurry);
  map = Apply(std::move(map), ToEdit(bundle));
  report.bundle = bundle;
  clock.End("map.bundle");
  const MapEdit redundant = CullKeyframes(map, id, context.options, &report.keyframes_culled);
  map = Apply(std::move(map), redundant);
  clock.End("map.cull_keyframes");
  return {std::move(map), std::move(report)};
}

}  // namespace planar_vslam
