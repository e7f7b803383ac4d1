#pragma once
// What the wheels read between keyframes of a map beside what laser and images say of the same motion. Internal.
#include <Eigen/Core>
#include <vector>

#include "planar_vslam/map/map.h"
#include "planar_vslam/optimize/bundle_adjustment.h"

namespace planar_vslam {

// Of a way (N = 2, in the frame of its start) or a turn (N = 1).
template <int N>
struct WheelComparison {
  using Vector = Eigen::Matrix<double, N, 1>;
  using Matrix = Eigen::Matrix<double, N, N>;
  Vector best;                // of both
  Vector off;                 // other - wheels
  Matrix of_wheels, of_rest;  // covariances of `off`: of what the wheels' noise adds, and of the rest
};
using WayComparison = WheelComparison<2>;
using TurnComparison = WheelComparison<1>;

// Of the links of keyframes from `first` on.
struct WheelComparisons {
  std::vector<TurnComparison> turns;         // with the map's poses
  std::vector<WayComparison> ways_by_laser;  // lengths of its own
  std::vector<WayComparison> ways_in_map;    // with the map's poses, whose lengths may be the wheels'
};
WheelComparisons CompareWheels(const Map& map, KeyframeId first, const MeasurementModel& model);

}  // namespace planar_vslam
