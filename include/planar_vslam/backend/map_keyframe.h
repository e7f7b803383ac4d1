#pragma once
// What happens to the map when a keyframe arrives: it is added, linked to earlier ones by matching their laser sweeps,
// recent landmarks are culled, new ones triangulated with its neighbours, duplicates fused, the neighbourhood
// bundle-adjusted, redundant keyframes culled. Loops are another job (look_back.h).
#include <string>
#include <vector>

#include "planar_vslam/backend/loop_closing.h"
#include "planar_vslam/geometry/option_fields.h"
#include "planar_vslam/geometry/stopwatch.h"
#include "planar_vslam/map/map.h"
#include "planar_vslam/map/map_edit.h"
#include "planar_vslam/optimize/bundle_adjustment.h"
#include "planar_vslam/optimize/map_uncertainty.h"
#include "planar_vslam/planar/scan_matching.h"

namespace planar_vslam {

struct MapperOptions {
  int triangulation_neighbors = 8;
  int link_neighbors = 3;
  int fusion_neighbors = 12;
  int window = 10;
  int wide_window = 40;
  int wide_every = 5;
  int young_map = 30;
  int min_shared = 12;
  int max_fixed = 60;
  double min_parallax = DegreesToRadians(1.0);
  double min_baseline_ratio = 0.01;
  int max_descriptor_distance = 50;
  double fusion_radius = 3.0;
  double redundancy = 0.9;
  double min_found_ratio = 0.25;
  double nearby_distance = 1.5;

  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    constexpr int kDescriptorBits = 256;
    v("triangulation_neighbors", o.triangulation_neighbors, unit::kNone, bound::AtLeast(1),
      "covisible keyframes new points are triangulated with...");
    v("link_neighbors", o.link_neighbors, unit::kNone, bound::AtLeast(0),
      "...and keyframes before it along the odometry chain");
    v("fusion_neighbors", o.fusion_neighbors, unit::kNone, bound::AtLeast(0), "keyframes searched for the same points");
    v("window", o.window, unit::kNone, bound::AtLeast(1),
      "keyframes the local bundle adjustment moves, beside the new one");
    v("wide_window", o.wide_window, unit::kNone, bound::AtLeast("window", o.window),
      "...of every wide_every-th: takes out what narrow windows have drifted", Origin::kFitted);
    v("wide_every", o.wide_every, unit::kNone, bound::AtLeast(1), "keyframes", Origin::kFitted);
    v("young_map", o.young_map, unit::kNone, bound::AtLeast(0),
      "keyframes up to which bundle adjustment moves the whole map", Origin::kFitted);
    v("min_shared", o.min_shared, unit::kNone, bound::AtLeast(1),
      "landmarks in common that make two keyframes neighbours");
    v("max_fixed", o.max_fixed, unit::kNone, bound::AtLeast(1), "keyframes around the window, held fixed");
    v("min_parallax_deg", o.min_parallax, unit::kDegrees, bound::Between(0.0, 90.0), "of a triangulated point");
    v("min_baseline_ratio", o.min_baseline_ratio, unit::kNone, bound::AtLeast(0.0), "baseline over median depth");
    v("max_descriptor_distance", o.max_descriptor_distance, unit::kNone, bound::FromTo(0, kDescriptorBits),
      "bits of 256");
    v("fusion_radius", o.fusion_radius, unit::kPixels, bound::Positive(), "at full resolution");
    v("redundancy", o.redundancy, unit::kNone, bound::MoreThan(0.0).And(bound::AtMost(1.0)),
      "share of landmarks three others see as well that makes a keyframe redundant");
    v("min_found_ratio", o.min_found_ratio, unit::kNone, bound::AtLeast(0.0).And(bound::LessThan(1.0)),
      "recent landmarks found in fewer of the images that should see them are erased");
    v("nearby_distance", o.nearby_distance, unit::kMeters, bound::AtLeast(0.0),
      "keyframes this near are searched for the same points in a metric map");
  }
  std::vector<std::string> Problems() const { return ProblemsOf(*this); }
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

// Where a culled keyframe was, relative to those of before and after it that remained: trajectories hang on them. Of
// extrinsics: a rescaled map scales camera motion only.
struct CulledKeyframe {
  struct Neighbor {
    KeyframeId id;
    Rigid3 T_neighbor_culled;  // bases
    Rigid3 T_base_camera;
  };
  KeyframeId id;
  Neighbor before, after;
  Rigid3 T_base_camera;
  ImageMoment moment = {};
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

// `hurry` is for the bundle adjustment (bundle_adjustment.h).
MappingOutcome MapKeyframe(const Map& snapshot, const KeyframeProposal& proposal, const MapperContext& context,
                           const std::atomic<bool>* hurry = nullptr);

// A map that has become metric just now, with the laser links that its keyframes would have got on arrival.
Map LinkedByLaser(Map map, const ScanMatchOptions& options);

}  // namespace planar_vslam
