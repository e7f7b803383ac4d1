#pragma once
// How uncertain a keyframe's pose is in its map, whose origin is the first keyframe: [x, y, heading], a right
// perturbation in the base. Bundle adjustment gives poses given the map around; what the map itself has drifted comes
// from the chain of everything that ties keyframes together. Each tie between keyframes i and j is a relative pose with
// information W, and with  e = Log(T_i_j^-1 T_map_i^-1 T_map_j),  de/dd_j = I,  de/dd_i = -Ad(T_i_j^-1):
//   H = sum J^T W J,  the first keyframe fixed;  the covariance is the keyframe's block of H^-1.
// Ties are
//   - odometry and laser links with their own covariance, and what each source reads long throughout, a share b of
//   every
//     motion it measured: unknowns of H beside the poses, with  de/db = -R_i_j^T t_i_j  and a prior of their own;
//   - landmarks in common. n of them, of N that j sees, at a depth z tell a heading to
//       sigma = k sigma_px / (f sqrt(n)) * N / n
//     and a position to z sigma, along the way between the two to a share of its length besides, which one camera does
//     not measure. The factor k makes up for what neighbours' ties share: they are no independent measurements, as they
//     come from the same landmarks. N / n: a pose goes with the majority of what it sees, so a few landmarks of an old
//     place do not bring it back there.
#include <Eigen/Core>

#include "planar_vslam/map/map.h"
#include "planar_vslam/optimize/bundle_adjustment.h"

namespace planar_vslam {

// Shares by which a source of motion may read wrong throughout.
struct SystematicErrors {
  double wheels = 0.005;
  double laser = 0.0005;
};

// `map` metric. Zero for the first keyframe.
Eigen::Matrix3d KeyframeCovariance(const Map& map, KeyframeId id, const BundleContext& context,
                                   const SystematicErrors& systematic);

}  // namespace planar_vslam
