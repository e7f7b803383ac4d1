#pragma once
// The surfaces that all sweeps of a map saw, and the pose of a sweep against them: what MatchScans (scan_matching.h)
// does between two sweeps, between one and all.
#include <Eigen/Core>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "planar_vslam/localize/likelihood_field.h"
#include "planar_vslam/planar/scan_matching.h"

namespace planar_vslam {

// The pose of the base as the laser measured it.
struct LaserFix {
  Rigid2 T_map_base;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  // of a right perturbation [x, y, angle]
  bool complete = false;                                     // surfaces faced every direction: x, y and angle are known
};

class SurfaceMap {
 public:
  // Surfaces on the map's floor, one for each square of 5 cm and direction: the mean of what the sweeps saw of it.
  SurfaceMap(const std::vector<PosedSweep>& sweeps, const ScanMatchOptions& options);

  bool empty() const { return blocks_.empty(); }
  // The pose of the base at the sweep, near `guess`. Nothing where it sees too little of the map or does not settle, or
  // where the result is more than `covariance` of the guess (as above) and its own explain.
  std::optional<LaserFix> Fix(const PlanarScan& scan, const Rigid3& T_base_laser, const Rigid2& guess,
                              const Eigen::Matrix3d& covariance) const;

 private:
  PreparedScan Around(const Eigen::Vector2d& p_map, double radius) const;

  ScanMatchOptions options_;
  std::map<std::pair<int, int>, std::vector<ScanSurface>> blocks_;  // by square metre
};

}  // namespace planar_vslam
