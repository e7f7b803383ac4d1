#include "planar_vslam/navigate/recovery.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

constexpr double kTurnShare = 0.6;     // of the fastest turn: a look round is not hurried
constexpr double kBackOffSpeed = 0.1;  // m/s
constexpr double kTimeLimit = 25.0;    // s, of one action
constexpr double kFar = 0.5;           // m: as far from where it was blocked, it is past it

}  // namespace

const char* ToString(RecoveryAction action) {
  switch (action) {
    case RecoveryAction::kNone:
      return "none";
    case RecoveryAction::kClear:
      return "clearing the laser's marks";
    case RecoveryAction::kTurn:
      return "looking round";
    case RecoveryAction::kBackOff:
      return "backing off";
    case RecoveryAction::kGiveUp:
      return "giving up";
  }
  return "";
}

RecoveryAction Recovery::Blocked(double time, const Rigid2& T_odom_base) {
  if (blocked_since_ < 0.0) {
    blocked_since_ = time;
    if (last_ == RecoveryAction::kNone) T_odom_start_ = T_odom_base;
  }
  if (time - blocked_since_ < options_.patience) return RecoveryAction::kNone;
  blocked_since_ = -1.0;
  started_ = time;
  turned_ = 0.0;
  last_angle_ = T_odom_base.angle;
  T_odom_start_ = T_odom_base;
  last_ = last_ == RecoveryAction::kGiveUp ? last_ : static_cast<RecoveryAction>(static_cast<int>(last_) + 1);
  active_ = last_ == RecoveryAction::kTurn || last_ == RecoveryAction::kBackOff;
  return last_;
}

void Recovery::Driving(const Rigid2& T_odom_base) {
  blocked_since_ = -1.0;
  if ((T_odom_base.translation - T_odom_start_.translation).norm() > kFar) last_ = RecoveryAction::kNone;
}

void Recovery::Reset() {
  last_ = RecoveryAction::kNone;
  active_ = false;
  blocked_since_ = -1.0;
}

PlaneVelocity Recovery::Step(double time, const Rigid2& T_odom_base, const Surroundings& surroundings) {
  if (time - started_ > kTimeLimit) active_ = false;
  if (!active_) return {};
  if (last_ == RecoveryAction::kTurn) {
    turned_ += std::abs(WrapAngle(T_odom_base.angle - last_angle_));
    last_angle_ = T_odom_base.angle;
    active_ = turned_ < 2.0 * M_PI;
    return {0.0, 0.0, active_ ? kTurnShare * options_.max_turn_rate : 0.0};
  }
  const PlaneVelocity back{-std::min(kBackOffSpeed, options_.max_speed), 0.0, 0.0};
  const double left = options_.back_off_distance - (T_odom_base.translation - T_odom_start_.translation).norm();
  const double needed = 2.0 * kBackOffSpeed * options_.reaction_time;
  active_ = left > 0.0 && surroundings.FreeLength(back, needed) >= needed;
  return active_ ? back : PlaneVelocity{};
}

}  // namespace planar_vslam
