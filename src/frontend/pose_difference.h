#pragma once
#include "planar_vslam/geometry/rigid3.h"

namespace planar_vslam {

inline bool IsNear(const Rigid3& a, const Rigid3& b, double distance, double angle) {
  const Vector6d difference = LogSe3(a.Inverse() * b);
  return difference.head<3>().norm() < distance && difference.tail<3>().norm() < angle;
}

}  // namespace planar_vslam
