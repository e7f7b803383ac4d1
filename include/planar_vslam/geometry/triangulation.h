#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "planar_vslam/geometry/rigid3.h"

namespace planar_vslam {

// Point seen along `ray_a` (any length, in camera a) and `ray_b` (in camera b), by the optimal-angle linear method (DLT
// on normalised rays). In frame a. Nothing when the rays are parallel or the point lies behind either camera.
std::optional<Eigen::Vector3d> TriangulateTwoRays(const Eigen::Vector3d& ray_a, const Eigen::Vector3d& ray_b,
                                                  const Rigid3& T_a_b);

// Angle between the rays from `center_a` and `center_b` to `point`, radians.
double ParallaxAngle(const Eigen::Vector3d& point, const Eigen::Vector3d& center_a, const Eigen::Vector3d& center_b);

}  // namespace planar_vslam
