#pragma once
// A base on wheels that follows velocity commands as far as its motors and the things around it let it.
#include <Eigen/Core>
#include <limits>

#include "planar_vslam/geometry/rigid2.h"
#include "planar_vslam/sim/obstacles.h"
#include "planar_vslam/sim/robot_spec.h"

namespace planar_vslam {

// In the base's own axes: x ahead, y to the left, yaw to the left.
struct VelocityCommand {
  double x = 0.0, y = 0.0;  // m/s
  double yaw = 0.0;         // rad/s

  bool IsFinite() const;
};

struct BaseState {
  Rigid2 T_world_base;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();      // x, y, yaw in the base's axes, m/s and rad/s
  bool touching = false;                                   // something in its way
  Eigen::Vector2d touched_at = Eigen::Vector2d::Zero();    // m, where the robot was when it met that
  bool overlapped = false;                                 // by somebody: nothing else gets into the body
  double stood = std::numeric_limits<double>::infinity();  // s since it last changed its place
  long collisions = 0;                                     // so far, with what it drove into
  long caught = 0;  // so far, people into a robot that moved or had stood for less than a second
  long bumps = 0;   // so far, people into a robot that had stood for longer
};

// What the base can make of a command: the direction is kept, the speed limited. A differential base leaves out what is
// sideways.
Eigen::Vector3d WithinLimits(const LimitsSpec& limits, BaseKind kind, const VelocityCommand& command);

// `seconds` later; `time` (s) is that of the result. Speeds approach the command at no more than the accelerations. In
// front of an obstacle the robot stops at once, a few millimetres clear of it: it can then turn, or move away.
BaseState StepBase(const LimitsSpec& limits, BaseKind kind, const Obstacles& obstacles, const BaseState& state,
                   const VelocityCommand& command, double time, double seconds);

}  // namespace planar_vslam
