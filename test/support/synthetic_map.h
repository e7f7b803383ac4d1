#pragma once
// A small known world for estimator tests: points around a path, seen by keyframes, without rendering.
#include <random>

#include "planar_vslam/map/map.h"
#include "planar_vslam/map/map_edit.h"
#include "planar_vslam/optimize/bundle_adjustment.h"

namespace planar_vslam::test {

struct SyntheticWorldOptions {
  int keyframes = 8;
  int points = 300;
  double step = 0.25;          // m between keyframes, along a gentle curve, camera looking sideways
  double pixel_noise = 0.0;    // px
  std::uint32_t seed = 1;
};

struct SyntheticWorld {
  CameraModel camera;
  OdometryNoise odometry_noise;
  Map map;                                   // true poses and points, exact odometry links, metric
  std::vector<Rigid3> true_poses;            // T_map_base per keyframe
  std::vector<Eigen::Vector3d> true_points;  // per landmark id
  BundleContext Context() const;
};

// Every landmark is seen by at least two keyframes. Descriptors are random and the same in every view.
SyntheticWorld MakeSyntheticWorld(const SyntheticWorldOptions& options);

// Poses (but the first) and points moved by Gaussian noise.
Map Perturbed(const SyntheticWorld& world, double position_sigma, double angle_sigma, double point_sigma, std::uint32_t seed);

}  // namespace planar_vslam::test
