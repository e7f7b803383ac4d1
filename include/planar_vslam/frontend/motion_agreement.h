#pragma once
// Whether wheel odometry can have moved the robot the way two views say. The views know rotation and the direction of
// translation, not its length s: with e(s) = Log(T~_b1_b2^-1 T_b1_c1 T_c1_c2(s) T_c2_b2), the distance is
//   min_s e^T (Sigma_odometry + Sigma_views(s) + Sigma_mount)^-1 e,   chi-square with 5 dof when they agree.
// Sigma_views is that of the second camera with the points marginalised, s held:
//   H = sum J_x^T J_x - J_x^T J_p (J_p^T J_p)^-1 J_p^T J_x,  Sigma = N (N^T H N)^-1 N^T,  N normal to a change of s.
// Sigma_mount is what an error xi of the mount, the same in both views, does: (Ad(T~_b1_b2^-1) - I) xi.
// It tells the mirrored motion that few views of a shallow scene explain as well (a turn one way for a step the other).
#include "planar_vslam/map/map.h"
#include "planar_vslam/optimize/bundle_adjustment.h"

namespace planar_vslam {

// Of the unscaled map of two keyframes, the second linked to the first by odometry.
double SquaredMotionDisagreement(const Map& two_views, const MeasurementModel& context);

}  // namespace planar_vslam
