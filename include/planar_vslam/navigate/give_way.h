#pragma once
// Out of the way of somebody who would walk into the robot: turn, drive straight ahead or back, stand.
#include <functional>

#include "planar_vslam/navigate/foresight.h"
#include "planar_vslam/navigate/surroundings.h"

namespace planar_vslam {

struct WayOut {
  PlaneVelocity velocity;  // to be sent now
  double cost = 0.0;       // s, as a speed plan's, without the way to the goal
  bool contact = false;    // even so
  double turn = 0.0;       // rad, first
  double length = 0.0;     // m, then; negative: back
};

// Whether people walk at a place of the map (m) at times.
using IsWalked = std::function<bool(const Eigen::Vector2d& p_map)>;

// The cheapest way out with the robot at `T_map_base`, going at `velocity`; standing still is one. Of ways that are as
// safe, one that ends where nobody walks, and a short one.
WayOut FindWayOut(const Foresight& foresight, const NavigateOptions& options, const Rigid2& T_map_base,
                  const PlaneVelocity& velocity, const Surroundings& surroundings, const IsWalked& is_walked);

}  // namespace planar_vslam
