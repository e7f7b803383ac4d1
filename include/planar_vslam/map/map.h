#pragma once
// The map as a value: keyframes and landmarks that refer to each other by id only. It changes only through edits
// (map_edit.h), which keep both directions of every reference in step.
#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/feature/features.h"
#include "planar_vslam/geometry/rigid3.h"
#include "planar_vslam/map/id.h"
#include "planar_vslam/map/image_moment.h"
#include "planar_vslam/map/keyframe_grid.h"
#include "planar_vslam/planar/preintegration.h"
#include "planar_vslam/sensor/measurements.h"
#include "planar_vslam/sensor/timestamp.h"

namespace planar_vslam {

// Planar motion from an earlier keyframe to the one that holds the link, as the wheels or the laser measured it.
struct MotionLink {
  KeyframeId from;
  PlanarMotion motion;
};

// A laser sweep taken near the keyframe that holds it. The laser sweeps in the plane of the floor, so the base is
// planar.
struct LaserSweep {
  std::shared_ptr<const PlanarScan> scan;  // written once, shared
  Rigid3 T_base_laser;
  Rigid2 T_keyframe_base;  // m even where the map is not metric: base at the sweep in the keyframe's base
};

struct Keyframe {
  Timestamp stamp;
  Rigid3 T_map_base;
  Rigid3 T_base_camera;                      // at `stamp`: the head moves
  FrameFeaturesPtr features;                 // written once, shared
  std::vector<LandmarkId> landmarks;         // per keypoint; invalid where it observes none
  std::optional<MotionLink> odometry_link;   // absent for the first keyframe and without odometry
  bool on_floor = true;                      // whether the floor prior may hold this pose (floor_monitor.h)
  std::vector<LaserSweep> sweeps = {};       // in the order they were added
  std::vector<MotionLink> laser_links = {};  // motion by matched sweeps, one an earlier keyframe, ascending
  ImageMoment moment = {};                   // what T_base_camera hangs on; not saved

  // Derived, kept by Apply(): the later keyframes that hold a link from this one, ascending.
  std::vector<KeyframeId> linked_by = {};

  Rigid3 T_map_camera() const { return T_map_base * T_base_camera; }
};

struct Observation {
  KeyframeId keyframe;
  std::uint32_t keypoint = 0;  // index into the keyframe's features
};

struct Landmark {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  std::vector<Observation> observations;  // ascending by keyframe, at most one a keyframe, never empty
  KeyframeId created_by;                  // keyframe whose processing created it; orders recent-landmark culling
  std::uint32_t predicted_visible = 1;    // frames that should have seen it...
  std::uint32_t found = 1;                // ...and did

  // Derived from the observations, kept by Apply().
  Descriptor descriptor{};                                   // the observed one nearest to all others (median distance)
  Eigen::Vector3d view_direction = Eigen::Vector3d::Zero();  // mean unit vector from the cameras to the point, map
  double min_distance = 0.0, max_distance = 0.0;             // from which scale-invariant detection can see it
};

struct Map {
  IdMap<KeyframeId, Keyframe> keyframes;
  IdMap<LandmarkId, Landmark> landmarks;
  std::uint32_t next_keyframe_id = 0;
  std::uint32_t next_landmark_id = 0;
  bool metric = false;                // whether lengths are metres
  std::vector<double> octave_scales;  // scale factor per pyramid level of the extractor that made the features

  // Derived, kept by Apply(): where the keyframes' bases and cameras stand.
  KeyframeGrid bases, cameras;
};

// Makes anew what Apply() keeps of links and places, for a map whose keyframes came another way.
void RebuildIndexes(Map* map);

// The keyframes that share at least `min_shared` landmarks with `id`, most shared first, ties by smaller id.
struct CovisibleKeyframe {
  KeyframeId id;
  int shared = 0;
};
std::vector<CovisibleKeyframe> CovisibleKeyframes(const Map& map, KeyframeId id, int min_shared);

// Every broken invariant, one line each; empty for a sound map. Checks both directions of every reference, order,
// sizes, finite numbers, odometry links to existing earlier keyframes, and that the indexes are those of the map.
std::vector<std::string> Validate(const Map& map);

}  // namespace planar_vslam
