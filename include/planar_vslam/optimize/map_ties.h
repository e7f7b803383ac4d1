#pragma once
// What holds the keyframes of a metric map where they are: ties, each a relative pose [x, y, heading] of two keyframes
// with a covariance. What the map has drifted, and how it gives way where a loop closes, is told by them.
//   - Odometry and laser links, with their own covariance: each with the floors of who measured.
//   - Landmarks in common. n of them, of N that j sees, at a depth z tell a heading to
//       sigma = k sigma_px / (f sqrt(n)) * N / n
//     and a position to z sigma, along the way between the two to a share of its length besides, which one camera does
//     not measure. The factor k makes up for what neighbours' ties share: they are no independent measurements, as they
//     come from the same landmarks. N / n: a pose goes with the majority of what it sees. With
//     keyframes a long way back only one that has returned there (distance_driven.h) is tied: a few landmarks of an old
//     place do not bring a pose home.
// A step of the wheels across which a rich view became quite another one is doubtful: something stood before the
// camera, or the robot was kidnapped. Until landmarks tie the two sides together it counts for next to nothing.
#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "planar_vslam/map/map.h"
#include "planar_vslam/optimize/bundle_adjustment.h"

namespace planar_vslam {

enum class TieSource { kWheels, kLaser, kLandmarks };

struct MapTie {
  std::size_t i, j;            // keyframes, by index in the map
  Eigen::Matrix3d covariance;  // of the right tangent [x, y, angle] at j
  TieSource source;
  bool doubtful = false;
};

// Of a metric map, in the order of keyframes.
std::vector<MapTie> TiesOf(const Map& map, const MeasurementModel& context);

}  // namespace planar_vslam
