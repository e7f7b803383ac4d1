#pragma once
// How fast to go along a path among people who walk: dynamic programming over place, time and speed (as in Kant and
// Zucker, 1986: the path is given, its velocity is planned). It goes in between passes, and waits where nobody walks.
#include <Eigen/Core>
#include <vector>

#include "planar_vslam/navigate/foresight.h"

namespace planar_vslam {

// The way ahead in steps of one length. The first place is the robot's own.
struct SpeedProblem {
  std::vector<Eigen::Vector2d> path;  // map, m, SpeedStep(options) apart
  std::vector<double> limit;          // m/s, at each place
  std::vector<bool> walked;           // whether people walk there at times
  double speed = 0.0;                 // m/s, now
  double delay = 0.0;                 // s, before it can move along the path: it turns
  double beyond = 0.0;                // m to the goal behind the end of `path`; 0: it ends there
  double hold = 0.0;                  // s that it will stand at the goal
  std::vector<double> gaps_out;       // m to whoever comes by when it leaves the goal, so many periods from now; empty:
                                      // nobody comes near the goal
};

struct SpeedPlan {
  double speed = 0.0;       // m/s, to be at one period from now
  double cost = 0.0;        // s
  bool contact = false;     // even so somebody walks into the robot, or nearly
  double contact_in = 0.0;  // s
};

// Metres between two places of a path.
double SpeedStep(const NavigateOptions& options);
// Places that can matter.
int SpeedPlaces(const NavigateOptions& options);

SpeedPlan PlanSpeed(const SpeedProblem& problem, const Foresight& foresight, const NavigateOptions& options);

}  // namespace planar_vslam
