#include "planar_vslam/sim/mobile_base.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

constexpr double kGap = 0.002;         // m that the robot keeps from what it stops in front of
constexpr double kSameContact = 0.03;  // m it must move before the next obstacle counts as another one
constexpr double kStands = 1.0;        // s: who walks into a robot that stands for so long could have seen that it does

// Both parts of the velocity with their own acceleration; the direction of the change is kept.
Eigen::Vector3d Approach(const LimitsSpec& limits, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                         double seconds) {
  Eigen::Vector3d change = to - from;
  const double linear = change.head<2>().norm(), most = limits.acceleration * seconds;
  if (linear > most) change.head<2>() *= most / linear;
  const double most_turn = limits.turn_acceleration * seconds;
  change.z() = std::clamp(change.z(), -most_turn, most_turn);
  return from + change;
}

}  // namespace

bool VelocityCommand::IsFinite() const { return std::isfinite(x) && std::isfinite(y) && std::isfinite(yaw); }

Eigen::Vector3d WithinLimits(const LimitsSpec& limits, BaseKind kind, const VelocityCommand& command) {
  Eigen::Vector3d wanted(command.x, kind == BaseKind::kDifferential ? 0.0 : command.y, command.yaw);
  const double share = std::hypot(wanted.x() / limits.speed, wanted.y() / limits.sideways_speed);
  if (share > 1.0) wanted.head<2>() /= share;
  wanted.z() = std::clamp(wanted.z(), -limits.turn_rate, limits.turn_rate);
  return wanted;
}

BaseState StepBase(const LimitsSpec& limits, BaseKind kind, const Obstacles& obstacles, const BaseState& state,
                   const VelocityCommand& command, double time, double seconds) {
  BaseState next = state;
  next.velocity = Approach(limits, state.velocity, WithinLimits(limits, kind, command), seconds);
  next.T_world_base = state.T_world_base * ExpSe2(seconds * next.velocity);
  const Eigen::Vector2d& from = state.T_world_base.translation;
  const double clearance = obstacles.Clearance(next.T_world_base.translation, time);
  const bool into = clearance < kGap && clearance <= obstacles.Clearance(from, time);
  const bool falls = obstacles.Falls(next.T_world_base) && !obstacles.Falls(state.T_world_base);
  const bool blocked = into || falls, moves = !next.velocity.head<2>().isZero(0.0);
  if (blocked) {
    next.velocity.head<2>().setZero();
    if (falls) next.velocity.z() = 0.0;
    next.T_world_base = state.T_world_base * ExpSe2(seconds * next.velocity);
  }
  next.overlapped = clearance < 0.0;
  next.stood = moves ? 0.0 : state.stood + seconds;
  // Who is in the body already walks on through it: that is one contact.
  const bool new_contact = (blocked || next.overlapped) && !state.touching && !state.overlapped;
  if (new_contact && blocked && moves) ++next.collisions;
  if (new_contact && !(blocked && moves)) ++(next.stood < kStands ? next.caught : next.bumps);
  if (blocked && !state.touching) next.touched_at = from;
  next.touching =
      blocked || (state.touching && (next.T_world_base.translation - next.touched_at).norm() < kSameContact);
  return next;
}

}  // namespace planar_vslam
