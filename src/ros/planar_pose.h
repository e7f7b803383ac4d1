#pragma once
// Poses in the plane, from messages.
#include <geometry_msgs/Pose.h>

#include <cmath>
#include <limits>

#include "planar_vslam/geometry/rigid2.h"

namespace planar_vslam::ros_face {

// The heading of a quaternion of any length; NaN where it has none.
inline double HeadingOf(const geometry_msgs::Quaternion& q) {
  const double length = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  if (!(length > 1e-6) || !std::isfinite(length)) return std::numeric_limits<double>::quiet_NaN();
  return std::atan2(2.0 * (q.w * q.z + q.x * q.y), length - 2.0 * (q.y * q.y + q.z * q.z));
}

inline Rigid2 PlanarOf(const geometry_msgs::Pose& pose) {
  Rigid2 T;
  T.translation = {pose.position.x, pose.position.y};
  T.angle = HeadingOf(pose.orientation);
  return T;
}

}  // namespace planar_vslam::ros_face
