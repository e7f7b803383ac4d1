#pragma once
// The camera motions a homography or an essential matrix allows, with unit translation, as T_second_first.
#include <Eigen/Core>
#include <vector>

#include "planar_vslam/geometry/rigid3.h"

namespace planar_vslam {

// `H` between rays (K^-1 H_pixels K), any scale and sign: up to eight motions, none for a pure rotation.
std::vector<Rigid3> MotionsFromHomography(const Eigen::Matrix3d& H);

// `E` with second^T E first = 0 between rays: four motions.
std::vector<Rigid3> MotionsFromEssential(const Eigen::Matrix3d& E);

}  // namespace planar_vslam
