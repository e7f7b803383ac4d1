#pragma once
// What happens to the map when a keyframe arrives: it is added, linked to earlier ones by matching their laser sweeps,
// recent landmarks are culled, new ones triangulated with its neighbours, duplicates fused, the neighbourhood
// bundle-adjusted, redundant keyframes culled. Loops are another job (look_back.h).
#include <string>
#include <vector>

#include "planar_vslam/backend/loop_closing.h"
#include "planar_vslam/geometry/stopwatch.h"
#include "planar_vslam/map/map.h"
#include "planar_vslam/map/map_edit.h"
#include "planar_vslam/optimize/bundle_adjustment.h"
#include "planar_vslam/optimize/map_uncertainty.h"
#include "planar_vslam/planar/scan_matching.h"

namespace planar_vslam {

struct MapperOptions {
  int triangulation_neighbors = 8;  // covisible keyframes new points are triangulated with
  int link_neighbors = 3;           // ...and keyframes before it along the odometry chain
  int fusion_neighbors = 12;
  int window = 10;                              // free keyframes of the local bundle adjustment, beside the new one
  int wide_window = 40;                         // ...and of every `wide_every`-th, any that see the same landmarks
  int wide_every = 5;                           // keyframes
  int young_map = 30;                           // keyframes up to which bundle adjustment takes the whole map
  int min_shared = 12;                          // landmarks in common that make two keyframes neighbours
  int max_fixed = 60;                           // border keyframes held fixed
  double min_parallax = DegreesToRadians(1.0);  // rad, of a triangulated point
  double min_baseline_ratio = 0.01;             // baseline over median depth
  int max_descriptor_distance = 50;             // bits
  double fusion_radius = 3.0;                   // px at octave 0
  double redundancy = 0.9;        // share of a keyframe's landmarks three others see as well that makes it redundant
  double min_found_ratio = 0.25;  // recent landmarks found in fewer of the frames that should see them are erased
  double nearby_distance = 1.5;   // m, keyframes this near are offered for fusion in a metric map
  double pixel_sigma = 1.0;       // px at octave 0

  std::vector<std::string> Problems() const;
};

struct MapperContext {
  MeasurementModel model;
  MapperOptions options;
  ScanMatchOptions scan_match;
  SystematicErrors systematic = {};
  LoopOptions loop = {};
};

// A tracked frame to be made a keyframe. `keyframe.landmarks` holds the tracker's matches; its odometry link is made
// here from `odometry` and the newest keyframe of the map.
struct KeyframeProposal {
  Keyframe keyframe;
  std::optional<PlanarMotion> odometry;  // since the keyframe proposed before
  CountSightings sightings;              // since the proposal before
  std::vector<AddSweeps> sweeps;         // likewise
  // Keyframes of this session from then on were not on the floor. Earlier ones, of a map that was loaded, may have
  // stamps of another clock.
  std::optional<Timestamp> off_floor_since;
  KeyframeId session_begin{0};  // the first keyframe of this session, or the id it gets
};

// Where a culled keyframe was, relative to one that remains: trajectories are re-anchored with it.
struct CulledKeyframe {
  KeyframeId id;
  KeyframeId anchor;
  Rigid3 T_anchor_culled;                   // bases
  Rigid3 T_anchor_camera, T_culled_camera;  // their extrinsics: a rescaled map scales camera motion only
};

struct MappingReport {
  KeyframeId keyframe;
  int laser_links = 0;
  int triangulated = 0;
  int fused = 0;
  int landmarks_culled = 0;
  std::vector<CulledKeyframe> keyframes_culled;
  BundleSummary bundle;  // of the neighbourhood: where it failed the map is as before it, and `message` says why
  // "map.copy", "map.arrival" (sightings, keyframe, sweeps), "map.laser_links", "map.cull_landmarks",
  // "map.triangulate", "map.fuse", "map.bundle" (split in `bundle.times`), "map.cull_keyframes"
  StageTimes times;
};

struct MappingOutcome {
  Map map;
  MappingReport report;
};

MappingOutcome MapKeyframe(const Map& snapshot, const KeyframeProposal& proposal, const MapperContext& context);

}  // namespace planar_vslam
