#include "planar_vslam/backend/map_keyframe.h"

#include <algorithm>

#include "stages.h"

namespace planar_vslam {
namespace {

// The tracker worked on an older map: matches to landmarks that are gone since do not count.
void DropMissingLandmarks(const Map& map, Keyframe* keyframe) {
  std::vector<LandmarkId> seen;
  for (LandmarkId& id : keyframe->landmarks) {
    if (!id.valid()) continue;
    if (!map.landmarks.Contains(id) || std::find(seen.begin(), seen.end(), id) != seen.end()) {
      id = LandmarkId{};
    } else {
      seen.push_back(id);
    }
  }
}

SetOffFloor OffFloorSince(const Map& map, Timestamp since, KeyframeId session_begin) {
  SetOffFloor off;
  for (const auto& [id, keyframe] : map.keyframes) {
    if (!(id < session_begin) && keyframe.stamp >= since) off.ids.push_back(id);
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
  int triangulated = 0;
  for (const KeyframeId neighbor : Neighbors(*map, id, o.triangulation_neighbors, o.link_neighbors, o.min_shared)) {
    const MapEdit edit = TriangulateWith(*map, id, neighbor, context);
    triangulated += static_cast<int>(edit.size());
    *map = Apply(std::move(*map), edit);
  }
  return triangulated;
}

}  // namespace

std::vector<std::string> MapperOptions::Problems() const {
  std::vector<std::string> problems;
  if (triangulation_neighbors < 1) problems.emplace_back("triangulation_neighbors must be at least 1");
  if (window < 1) problems.emplace_back("window must be at least 1");
  if (wide_window < window) problems.emplace_back("wide_window must be at least window");
  if (wide_every < 1) problems.emplace_back("wide_every must be at least 1");
  if (young_map < 0) problems.emplace_back("young_map must be at least 0");
  if (max_fixed < 1) problems.emplace_back("max_fixed must be at least 1");
  if (!(min_parallax > 0.0)) problems.emplace_back("min_parallax must be positive (rad)");
  if (!(redundancy > 0.0 && redundancy <= 1.0)) problems.emplace_back("redundancy must lie in (0, 1]");
  if (!(min_found_ratio >= 0.0 && min_found_ratio < 1.0)) problems.emplace_back("min_found_ratio must lie in [0, 1)");
  if (!(fusion_radius > 0.0)) problems.emplace_back("fusion_radius must be positive (px)");
  if (!(pixel_sigma > 0.0)) problems.emplace_back("pixel_sigma must be positive (px)");
  return problems;
}

MappingOutcome MapKeyframe(const Map& snapshot, const KeyframeProposal& proposal, const MapperContext& context) {
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

  const BundleResult bundle = AdjustBundle(map, LocalRequest(map, id, context.options), context.model);
  map = Apply(std::move(map), ToEdit(bundle));
  report.bundle = bundle;
  clock.End("map.bundle");
  const MapEdit redundant = CullKeyframes(map, id, context.options, &report.keyframes_culled);
  map = Apply(std::move(map), redundant);
  clock.End("map.cull_keyframes");
  return {std::move(map), std::move(report)};
}

}  // namespace planar_vslam
