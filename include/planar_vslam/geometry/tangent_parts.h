#pragma once
// The rows of a 6-D tangent [translation, rotation] of SE(3) that are motion on the floor, and those that leave it.
#include <array>

namespace planar_vslam {

inline constexpr std::array<int, 3> kPlanarRows{0, 1, 5};  // x, y, yaw
inline constexpr std::array<int, 3> kFloorRows{2, 3, 4};   // z, roll, pitch

}  // namespace planar_vslam
