#pragma once
// Metric scale of an up-to-scale visual trajectory from wheel odometry over the same keyframes.
// metric = scale * visual.
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "planar_vslam/geometry/rigid2.h"
#include "planar_vslam/geometry/rigid3.h"

namespace planar_vslam {

// The same instants seen by both: positions of the same point of the robot (the base), visual up to scale.
struct ScalePair {
  Eigen::Vector3d p_visual;    // base position in the visual map, arbitrary scale
  Eigen::Vector3d p_odometry;  // base position in the odometry frame, m
};

// The paper's Eq. (escale-1): s = sqrt(sum |dp_odometry|^2) / sqrt(sum |dp_visual|^2) over consecutive keyframes.
// Biased low by visual noise, because E|dp_visual|^2 contains it. (The paper's text swaps the two labels.)
std::optional<double> ScaleFromSteps(const std::vector<ScalePair>& pairs);

// Horn's form on centroid-relative positions: s = sqrt(sum |p_odometry - mean|^2 / sum |p_visual - mean|^2).
std::optional<double> ScaleFromCentroids(const std::vector<ScalePair>& pairs);

// The base's positions in an up-to-scale map depend on the scale through the camera's lever arm: T_map_camera is what
// the map knows. Solves for the scale s for which s * p_map_camera - R_map_base p_base_camera has the odometry's sum of
// squared steps or of squared distances from the centroid: a quadratic in s. Inputs per keyframe.
struct LeverArmSample {
  Rigid3 T_map_camera;   // visual, arbitrary scale
  Rigid3 T_base_camera;  // metric
  Rigid2 T_odom_base;    // metric
};
enum class ScaleMethod { kSteps, kCentroids };
// Nothing when there are fewer than 3 samples, the base moved less than `min_distance` metres in all, or the lever arm
// swung more than the base moved (turning on the spot), where two scales explain the same motion.
std::optional<double> RecoverScale(const std::vector<LeverArmSample>& samples, ScaleMethod method, double min_distance);

// The motion T_ref_base with the camera's part of it multiplied by `scale`; the extrinsics stay metric.
Rigid3 ScaleCameraMotion(const Rigid3& T_ref_base, const Rigid3& T_refbase_camera, const Rigid3& T_base_camera,
                         double scale);

}  // namespace planar_vslam
