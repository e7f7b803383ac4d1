#pragma once
// The map handed to mapping2d as plain posed points and scans.
#include <vector>

#include "planar_vslam/map/map.h"
#include "planar_vslam/mapping2d/map_builder.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam {

// Which landmarks are good enough for a navigation map.
struct LandmarkAcceptance {
  int min_observations = 3;
  double min_parallax = DegreesToRadians(1.5);  // rad, widest among its observers
  double max_relative_depth_sigma = 0.10;       // of the distance
  double min_height = -0.03;                    // m: below the floor are only reflections
  double pixel_sigma = 1.0;                     // px
};

// Points and laser sweeps of the keyframes; the robot's footprint is free at each keyframe and sweep, and along the
// straight pieces of odometry between keyframes. Empty for a map that is not metric.
MapBuilder BuildNavigationMap(const Map& map, const CameraModel& camera, const MapBuilderOptions& options,
                              const LandmarkAcceptance& acceptance);

// Landmarks as a cloud: normal towards the observers, intensity is the number of observations.
std::vector<CloudPoint> LandmarkCloud(const Map& map);

}  // namespace planar_vslam
