#pragma once
// The map is bent until a place that was recognised (loop_detection.h) is one: a pose graph spreads the error over the
// way since (pose_graph.h), landmarks move with the keyframes that made them, and what both sides see is merged. Bundle
// adjustment of the whole map has to follow. Lengths stay: the map is metric.
#include <optional>

#include "planar_vslam/backend/loop_detection.h"
#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/map/map_edit.h"
#include "planar_vslam/optimize/pose_graph.h"

namespace planar_vslam {

struct BentMap {
  Map map;
  MapEdit structure;  // what was done to it beside moving keyframes and landmarks, in order
};

// The map with poses, landmarks and observations as the loop says; not yet adjusted. Steps of the wheels that the loop
// contradicts are gone. `ties` are those of the map. Error: why the pose graph has no solution.
Expected<BentMap> CloseLoop(Map map, const Loop& loop, const std::vector<MapTie>& ties,
                            const PlanarPriorOptions& planar);

}  // namespace planar_vslam
