#pragma once
// A short stay at a goal that lies where people walk: from a place beside their way straight in, turned to the goal's
// heading, and out again before somebody comes. In, turn, stay and out are one manoeuvre, foreseen as a whole.
#include <optional>
#include <vector>

#include "planar_vslam/navigate/costmap.h"
#include "planar_vslam/navigate/foresight.h"
#include "planar_vslam/navigate/surroundings.h"

namespace planar_vslam {

struct Visit {
  static constexpr double kForesight = 24.0;  // s: a turn of somebody who walks to and fro, and the visit
  static constexpr double kStay = 1.4;        // s at a goal, until the robot is sent elsewhere

  Rigid2 T_map_wait;   // beside the way, facing as it goes in
  Rigid2 T_map_there;  // within the goal's tolerance, with the goal's heading
  bool back = false;   // it goes in backwards
};

struct VisitStep {
  PlaneVelocity velocity;  // to be sent to the base
  bool there = false;      // at the place and the heading
};
// On the way in. `velocity` is the last one that was sent, `period` (s) the time since then.
VisitStep StepVisit(const Visit& visit, const NavigateOptions& options, const Rigid2& T_map_base,
                    const PlaneVelocity& velocity, double period);

// How close somebody comes to the body (m, negative: into it) where the robot goes on with a visit after `delay` (s),
// stays, and then leaves by the best way out.
double GapOfVisit(const Visit& visit, const Foresight& foresight, const NavigateOptions& options,
                  const Costmap& costmap, const Rigid2& T_map_base, const PlaneVelocity& velocity, double delay);

// How close somebody comes (m, negative: into it) to a robot that leaves a place, by the best way out or by standing
// there, so many periods of foresight from now. Empty where nobody comes near the place.
std::vector<double> GapsOut(const Rigid2& T_map_place, const Foresight& foresight, const NavigateOptions& options,
                            const Costmap& costmap);

// The visit with the widest gap that foresight has at some time, `least` (m) or more. `foresight` reaches
// Visit::kForesight ahead.
std::optional<Visit> FindVisit(const Rigid2& T_map_goal, const Foresight& foresight, const NavigateOptions& options,
                               const Costmap& costmap, const Rigid2& T_map_base, double least);

}  // namespace planar_vslam
