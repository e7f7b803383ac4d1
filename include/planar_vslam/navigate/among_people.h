#pragma once
// What the controller wants, changed so that nobody walks into the robot: slower, later, or out of the way first.
#include <vector>

#include "planar_vslam/navigate/give_way.h"
#include "planar_vslam/navigate/speed_plan.h"

namespace planar_vslam {

struct Intention {
  PlaneVelocity velocity;             // that the controller would send
  std::vector<Eigen::Vector2d> path;  // map, m, the way ahead from the robot, SpeedStep apart; the robot's own place
                                      // alone where it does not want to move
  double beyond = 0.0;                // m from there to the goal
  double turn = 0.0;                  // rad that it turns in place first
  double hold = 0.0;                  // s that it will stand at the goal
  std::vector<double> gaps_out;       // as a speed problem has it
};

enum class PeopleAction { kNone, kWait, kGiveWay };

struct Adapted {
  PeopleAction action = PeopleAction::kNone;
  PlaneVelocity velocity;
};

// `velocity` is the last one that was sent, `period` (s) the time since then.
Adapted AdaptToPeople(const Intention& intention, const Foresight& foresight, const NavigateOptions& options,
                      const Costmap& costmap, const Surroundings& surroundings, const IsWalked& is_walked,
                      const Rigid2& T_map_base, const PlaneVelocity& velocity, double period);

}  // namespace planar_vslam
