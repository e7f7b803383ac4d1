#pragma once
// A small known world for estimator tests: points around a path, seen by keyframes, without rendering.
#include <memory>
#include <random>
#include <vector>

#include "planar_vslam/backend/map_keyframe.h"
#include "planar_vslam/map/map.h"
#include "planar_vslam/map/map_edit.h"
#include "planar_vslam/optimize/bundle_adjustment.h"

namespace planar_vslam::test {

struct SyntheticWorldOptions {
  int keyframes = 8;
  int points = 300;
  int floor_points = 0;      // beside these, on the floor
  double step = 0.25;        // m between keyframes, along a gentle curve, camera looking sideways
  double pixel_noise = 0.0;  // px
  std::uint32_t seed = 1;
};

struct SyntheticWorld {
  CameraModel camera;
  OdometryNoise odometry_noise;
  Map map;                                   // true poses and points, exact odometry links, metric
  std::vector<Rigid3> true_poses;            // T_map_base per keyframe
  std::vector<Eigen::Vector3d> true_points;  // per landmark id
  Rigid3 T_base_camera;                      // the same for all keyframes
  MeasurementModel Context() const;
};

// Where the base of a synthetic world is after `x` metres: true_poses are at multiples of the step.
Rigid3 SyntheticPose(double x);

// Every landmark is seen by at least two keyframes. Descriptors are random and the same in every view.
SyntheticWorld MakeSyntheticWorld(const SyntheticWorldOptions& options);

// What a camera sees of the world's landmarks, and which landmark each keypoint shows.
struct SyntheticView {
  std::shared_ptr<const FrameFeatures> features;
  std::vector<LandmarkId> landmarks;  // per keypoint
};
SyntheticView Observe(const SyntheticWorld& world, const Rigid3& T_map_camera, double pixel_noise, std::uint32_t seed);

// What the back end tells of a keyframe of the map that it culls.
CulledKeyframe Culled(const Map& map, KeyframeId id);

// Wheel odometry that measured the way between two base poses without error.
PlanarMotion ExactOdometry(const SyntheticWorld& world, const Rigid3& T_map_i, const Rigid3& T_map_j);

// Poses (but the first) and points moved by Gaussian noise.
Map Perturbed(const SyntheticWorld& world, double position_sigma, double angle_sigma, double point_sigma,
              std::uint32_t seed);

}  // namespace planar_vslam::test
