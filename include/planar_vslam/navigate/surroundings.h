#pragma once
// What is in the way of the body now: the costmap, and the last sweep in the base's own frame. The second does not
// depend on where localisation believes the robot to be.
#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "planar_vslam/navigate/costmap.h"

namespace planar_vslam {

// In the base's axes: x ahead, y to the left, m/s; yaw to the left, rad/s.
struct PlaneVelocity {
  double x = 0.0, y = 0.0, yaw = 0.0;

  double Speed() const { return std::hypot(x, y); }
};

// The returns of a sweep, in the base's frame at its stamp.
std::vector<Eigen::Vector2d> PointsOf(const PlanarScan& scan, const Rigid2& T_base_laser);

class Surroundings {
 public:
  // `costmap` is kept by reference. `points` are in the base's frame now.
  Surroundings(const Costmap& costmap, const NavigateOptions& options, const Rigid2& T_map_base,
               std::vector<Eigen::Vector2d> points);

  // How far the body gets along the arc of `velocity` (nothing in yaw alone) until it would come closer to something
  // than the safety margin, or than it is now where that is closer still; at most `length`. Metres.
  double FreeLength(const PlaneVelocity& velocity, double length) const;
  // From the body to the nearest obstacle where it stands, m, and with its axis elsewhere.
  double Clearance() const { return ClearanceAt(Eigen::Vector2d::Zero()); }
  double ClearanceAt(const Eigen::Vector2d& p_base) const;

 private:
  double LaserClearance(const Eigen::Vector2d& p_base) const;

  const Costmap& costmap_;
  const NavigateOptions& options_;
  Rigid2 T_map_base_;
  std::vector<Eigen::Vector2d> points_;
};

}  // namespace planar_vslam
