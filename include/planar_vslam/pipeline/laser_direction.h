#pragma once
// Which way a laser looks, by how its sweeps change while the robot drives: where they fit the wheels' way clearly
// better with the laser turned, its yaw in tf is wrong. Told to 5 degrees, for faults of tf, not for calibration.
#include <array>
#include <optional>

#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

class LaserDirection {
 public:
  // Two sweeps and the base's motion between them, in any order of pairs. Others than motions of 0.3 to 1 m with little
  // turn say nothing and are left out.
  void Add(const LaserFrame& first, const LaserFrame& second, const Rigid2& T_first_second);
  // rad in (-pi, pi], about the laser's own axis: how much further it is turned than T_base_laser says. Nothing where
  // it looks where it should, or too little was driven to tell.
  std::optional<double> Turned() const;
  bool IsDone() const { return pairs_ >= kMostPairs; }

 private:
  static constexpr int kMostPairs = 150;  // that tell
  static constexpr std::size_t kDirections = 72;

  std::array<double, kDirections> differences_{};  // m, summed over the pairs; of ranges, by direction
  int pairs_ = 0;
};

}  // namespace planar_vslam
