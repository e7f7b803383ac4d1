#pragma once
#include <cmath>

namespace planar_vslam {

// The same angle in (-pi, pi]. Radians.
inline double WrapAngle(double angle) {
  const double wrapped = std::remainder(angle, 2.0 * M_PI);
  return wrapped <= -M_PI ? wrapped + 2.0 * M_PI : wrapped;
}

constexpr double DegreesToRadians(double degrees) { return degrees * M_PI / 180.0; }
constexpr double RadiansToDegrees(double radians) { return radians * 180.0 / M_PI; }

}  // namespace planar_vslam
