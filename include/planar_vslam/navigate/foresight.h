#pragma once
// Where people will be in the next seconds, and what it costs to be near them.
#include <Eigen/Core>
#include <vector>

#include "planar_vslam/navigate/options.h"

namespace planar_vslam {

struct Foresight {
  static constexpr double kPeriod = 0.25;  // s
  // Of each person who walks, map, m: now, one period later and so on; all of the same length.
  std::vector<std::vector<Eigen::Vector2d>> people;
  bool steady = true;  // all walk in a rhythm that is known

  bool empty() const { return people.empty(); }
  int count() const { return people.empty() ? 0 : static_cast<int>(people.front().size()); }
};

// What a second costs, in seconds of a detour, with the robot's axis at `p_map` when `step` periods have passed. From
// kContact on somebody walks into it.
struct Risk {
  static constexpr double kContact = 50.0;
  double rate = 0.0;
  bool contact() const { return rate >= kContact; }
};
// From the body with its axis at `p_map` to the nearest of them after `time` (s), m; negative inside.
double GapAt(const Foresight& foresight, const NavigateOptions& options, const Eigen::Vector2d& p_map, double time);
Risk RiskAt(const Foresight& foresight, const NavigateOptions& options, const Eigen::Vector2d& p_map, int step);

}  // namespace planar_vslam
