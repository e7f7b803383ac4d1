#pragma once
// The SLAM map handed to mapping2d as plain posed points and scans, and kept in step with it.
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "planar_vslam/map/map.h"
#include "planar_vslam/mapping2d/map_builder.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam {

// Which landmarks are good enough for a navigation map. Fitted: chosen while looking at grids of the drives of
// BENCHMARK.md.
struct LandmarkAcceptance {
  int min_observations = 3;
  double min_parallax = DegreesToRadians(1.5);  // rad, widest among its observers
  double max_relative_depth_sigma = 0.10;       // of the distance
  double max_depth_sigma = 0.15;                // m from the nearest observer: three of the usual cells
  double neighbor_radius = 0.25;                // m...
  int min_neighbors = 4;                        // ...within which as many others are: wrong points stand alone
  // An obstacle is upright: so many other landmarks of blocking depth stand above or below one that blocks, within a
  // usual cell's width, and it projects to where it was seen. Wrong depths scatter.
  double upright_radius = 0.05;  // m, horizontally
  int min_upright = 2;
  double max_reprojection = 1.5;  // pixel sigmas RMS, at the keypoints' scales
  double min_height = -0.03;      // m: below the floor are only reflections
  double pixel_sigma = 1.0;       // px, of a keypoint at full resolution

  static LandmarkAcceptance For(double pixel_sigma);
};

struct AcceptedLandmarks;

// How far the SLAM map may move before what a keyframe said is taken out and put in anew.
struct NavigationTolerance {
  double distance = 0.0;     // m, of cameras, landmarks, scans, footprints
  double angle = 0.0;        // rad, of scans
  double depth_sigma = 0.0;  // relative

  // Half a cell but at least a centimetre, half a degree, a quarter of the depth sigma.
  static NavigationTolerance For(double resolution);
};

// Points and laser sweeps of the keyframes; the robot's footprint is free at each keyframe and sweep, and along the
// straight pieces of odometry between keyframes. Empty for a map that is not metric.
class NavigationMap {
 public:
  NavigationMap(const MapBuilderOptions& options, const LandmarkAcceptance& acceptance,
                const NavigationTolerance& tolerance);
  ~NavigationMap();
  NavigationMap(NavigationMap&&) noexcept;
  NavigationMap& operator=(NavigationMap&&) noexcept;

  // Integrates what is new, takes out what is gone, and replaces what has moved beyond the tolerance. Where nothing
  // moved by less than that, the result equals that of a new NavigationMap, to the bit. Returns how many keyframes
  // were integrated or taken out.
  int Update(const Map& map, const CameraModel& camera);
  // As MapBuilder has it.
  void SetBand(double band_min, double band_max) { builder_.SetBand(band_min, band_max); }
  const MapBuilder& builder() const& { return builder_; }
  MapBuilder builder() && { return std::move(builder_); }

 private:
  struct Evidence;  // what one keyframe says
  void IntegrateSightings(const Evidence& evidence);
  void TakeOutSightings(const Evidence& evidence);
  void TakeOut(const std::vector<KeyframeId>& outdated);
  void TakeOut(int epoch, const std::vector<KeyframeId>& outdated);
  std::vector<Overhang> Overhangs(const Map& map, const AcceptedLandmarks& accepted) const;

  LandmarkAcceptance acceptance_;
  NavigationTolerance tolerance_;
  double hit_sigma_;  // m
  OverhangOptions overhang_;
  LeggedOptions legged_;
  MapBuilder builder_;
  std::map<KeyframeId, Evidence> held_;
};

// Of one map, once.
MapBuilder BuildNavigationMap(const Map& map, const CameraModel& camera, const MapBuilderOptions& options,
                              const LandmarkAcceptance& acceptance);

// Landmarks as a cloud: normal towards the observers, intensity is the number of observations.
std::vector<CloudPoint> LandmarkCloud(const Map& map);

}  // namespace planar_vslam
