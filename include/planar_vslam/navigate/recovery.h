#pragma once
// What is tried, in turn, when the robot is blocked: forget the laser's marks, look round, back off; then give up.
#include "planar_vslam/navigate/surroundings.h"

namespace planar_vslam {

enum class RecoveryAction { kNone, kClear, kTurn, kBackOff, kGiveUp };
const char* ToString(RecoveryAction action);

class Recovery {
 public:
  explicit Recovery(const NavigateOptions& options) : options_(options) {}

  // Blocked at `time` (s): nothing until the patience is over, then one action a time. The next one takes its turn when
  // the robot is still, or again, blocked after it.
  RecoveryAction Blocked(double time, const Rigid2& T_odom_base);
  // The robot drives. Once it came far enough, the actions begin anew.
  void Driving(const Rigid2& T_odom_base);
  void Reset();

  // While an action lasts it says what to do; kTurn and kBackOff take several steps.
  bool active() const { return active_; }
  PlaneVelocity Step(double time, const Rigid2& T_odom_base, const Surroundings& surroundings);

 private:
  NavigateOptions options_;
  RecoveryAction last_ = RecoveryAction::kNone;
  bool active_ = false;
  double blocked_since_ = -1.0;             // s; negative: not blocked
  double started_ = 0.0;                    // s
  Rigid2 T_odom_start_;                     // where the action, or being blocked, began
  double turned_ = 0.0, last_angle_ = 0.0;  // rad
};

}  // namespace planar_vslam
