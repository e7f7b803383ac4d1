#include "planar_vslam/sim/robot_spec.h"

#include <algorithm>

namespace planar_vslam {

Rigid3 CameraSpec::T_base_camera() const {
  // Columns: the optical frame's x (right), y (down) and z (forward) axes in the base, then the tilt about its x axis.
  Eigen::Matrix3d R_base_level;
  R_base_level << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const Eigen::AngleAxisd tilt(-tilt_down, Eigen::Vector3d::UnitX());
  return {Eigen::Quaterniond(R_base_level * tilt.toRotationMatrix()), position};
}

Rigid3 LaserSpec::T_base_laser() const { return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, 0.0, height)}; }

// Three sensors with 60 degrees each.
bool LaserSpec::Looks(double angle) const {
  if (kind != LaserKind::kPepper) return kind == LaserKind::kFull;
  constexpr double kHalf = M_PI / 6.0, kRounding = 1e-9;  // rad
  const double from_nearest = std::min({std::abs(angle), std::abs(angle - M_PI_2), std::abs(angle + M_PI_2)});
  return from_nearest <= kHalf + kRounding;
}

}  // namespace planar_vslam
