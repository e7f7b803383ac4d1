#include "planar_vslam/backend/map_keyframe.h"

#include <algorithm>

#include "planar_vslam/map/queries.h"
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

int FuseWithNeighbors(Map* map, KeyframeId newest, const MapperContext& context) {
  const MapperOptions& o = context.options;
  const std::vector<KeyframeId> neighbors =
      WithNearby(*map, newest, Neighbors(*map, newest, o.fusion_neighbors, 1, o.min_shared), o);
  int steps = 0;
  for (const KeyframeId neighbor : neighbors) {
    const MapEdit edit = FuseInto(*map, ValidOnly(map->keyframes.At(newest).landmarks), neighbor, context);
    steps += static_cast<int>(edit.size());
    *map = Apply(std::move(*map), edit);
  }
  const MapEdit edit = FuseInto(*map, LandmarksOf(*map, neighbors), newest, context);
  *map = Apply(std::move(*map), edit);
  return steps + static_cast<int>(edit.size());
}

SetOffFloor OffFloorSince(const Map& map, Timestamp since) {
  SetOffFloor off;
  for (const auto& [id, keyframe] : map.keyframes) {
    if (keyframe.stamp >= since) off.ids.push_back(id);
  }
  return off;
}

BundleResult WithoutValues(BundleResult result) {
  result.poses.clear();
  result.points.clear();
  result.outliers.clear();
  return result;
}

// Closes the loop that the newest keyframe shows, if it does.
bool CloseLoopAt(Map* map, KeyframeId newest, const MapUncertainty& uncertainty, const MapperContext& context,
                 MappingReport* report) {
  const std::optional<Loop> loop = FindLoop(*map, newest, uncertainty, context.model, context.loop);
  if (!loop.has_value()) return false;
  std::optional<Map> closed = CloseLoop(*map, *loop, context.model);
  if (!closed.has_value()) return false;
  const Rigid3 T_map_before = map->keyframes.At(newest).T_map_base;
  *map = std::move(*closed);
  for (const LoopView& view : loop->views) FuseWithNeighbors(map, view.keyframe, context);
  const MapEdit laser = LinkByLaser(*map, newest, context.scan_match);
  *map = Apply(std::move(*map), laser);
  const BundleResult bundle = AdjustBundle(*map, WholeMapRequest(*map), context.model);
  *map = Apply(std::move(*map), ToEdit(bundle));
  report->loop = ClosedLoop{loop->old, T_map_before.Inverse() * map->keyframes.At(newest).T_map_base};
  return true;
}

// How well the map knows where the newest keyframe stands, once a loop that ends there is closed.
void LookBack(Map* map, KeyframeId newest, const MapperContext& context, MappingReport* report) {
  const MapUncertainty uncertainty(*map, TiesOf(*map, context.model), context.systematic);
  if (!CloseLoopAt(map, newest, uncertainty, context, report)) {
    report->covariance = uncertainty.CovarianceOf(newest);
    return;
  }
  const MapUncertainty closed(*map, TiesOf(*map, context.model), context.systematic);
  report->covariance = closed.CovarianceOf(newest);
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

MappingOutcome MapKeyframe(Map map, const KeyframeProposal& proposal, const MapperContext& context) {
  MappingReport report;
  const KeyframeId id{map.next_keyframe_id};
  report.keyframe = id;
  Keyframe keyframe = proposal.keyframe;
  DropMissingLandmarks(map, &keyframe);
  if (proposal.odometry.has_value()) {
    keyframe.odometry_link = MotionLink{std::prev(map.keyframes.end())->first, *proposal.odometry};
  }
  MapEdit arrival{proposal.sightings, AddKeyframe{id, std::move(keyframe)}};
  arrival.insert(arrival.end(), proposal.sweeps.begin(), proposal.sweeps.end());
  if (proposal.off_floor_since.has_value()) arrival.emplace_back(OffFloorSince(map, *proposal.off_floor_since));
  map = Apply(std::move(map), arrival);
  const MapEdit laser = LinkByLaser(map, id, context.scan_match);
  map = Apply(std::move(map), laser);
  report.laser_links = static_cast<int>(map.keyframes.At(id).laser_links.size());

  const std::size_t before = map.landmarks.size();
  const MapEdit recent = CullRecentLandmarks(map, id, context.options);
  map = Apply(std::move(map), recent);
  report.landmarks_culled = static_cast<int>(before - map.landmarks.size());

  const MapperOptions& o = context.options;
  for (const KeyframeId neighbor : Neighbors(map, id, o.triangulation_neighbors, o.link_neighbors, o.min_shared)) {
    const MapEdit edit = TriangulateWith(map, id, neighbor, context);
    report.triangulated += static_cast<int>(edit.size());
    map = Apply(std::move(map), edit);
  }
  report.fused = FuseWithNeighbors(&map, id, context);

  const BundleResult bundle = AdjustBundle(map, LocalRequest(map, id, o), context.model);
  map = Apply(std::move(map), ToEdit(bundle));
  report.bundle = WithoutValues(bundle);

  if (map.metric) LookBack(&map, id, context, &report);

  const MapEdit redundant = CullKeyframes(map, id, o, &report.keyframes_culled);
  map = Apply(std::move(map), redundant);
  return {std::move(map), std::move(report)};
}

MappingOutcome AdjustWholeMap(Map map, const MeasurementModel& context) {
  const BundleResult bundle = AdjustBundle(map, WholeMapRequest(map), context);
  MappingReport report;
  report.bundle = WithoutValues(bundle);
  map = Apply(std::move(map), ToEdit(bundle));
  return {std::move(map), std::move(report)};
}

}  // namespace planar_vslam
