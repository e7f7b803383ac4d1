#pragma once
// How long a turn in place takes.
#include <cmath>

#include "planar_vslam/navigate/options.h"

namespace planar_vslam {

// Seconds from standing to standing, `angle` (rad) not negative.
inline double TurnTime(const NavigateOptions& options, double angle) {
  const double ramps = options.max_turn_rate / options.turn_acceleration;  // s, up and down again
  if (angle < ramps * options.max_turn_rate) return 2.0 * std::sqrt(angle / options.turn_acceleration);
  return angle / options.max_turn_rate + ramps;
}

}  // namespace planar_vslam
