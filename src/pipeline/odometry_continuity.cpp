#include "planar_vslam/pipeline/odometry_continuity.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace planar_vslam {
namespace {

constexpr double kFastest = 4.0, kShortestJump = 0.05;            // m/s, m
constexpr double kFastestTurn = 6.0, kSmallestTurn = 0.1;         // rad/s, rad
constexpr double kThanBefore = 3.0;                               // times as fast, or as long
constexpr std::size_t kRemembered = 10;                           // steps
constexpr double kFastestStart = 50.0, kFastestStartTurn = 30.0;  // m/s, rad/s
constexpr double kInMotion = 0.1;                                 // m/s or rad/s
constexpr double kAtRest = 1e-4;                                  // m or rad in a step
constexpr double kLongestBridge = 0.5;                            // s over which a velocity is taken to hold
constexpr double kFarthest = 1e7;                                 // m: a larger reading is corrupt

bool IsUsable(const Rigid2& T) {
  return T.translation.allFinite() && T.translation.cwiseAbs().maxCoeff() < kFarthest && std::isfinite(T.angle);
}

}  // namespace

bool OdometryContinuity::IsJump(const Step& step) const {
  if (steps_.empty()) {
    return (step.way > kShortestJump && step.way > kFastestStart * step.seconds) ||
           (step.turn > kSmallestTurn && step.turn > kFastestStartTurn * step.seconds);
  }
  const Step& before = steps_.back();
  double way = 0.0, turn = 0.0;
  for (const Step& one : steps_) {
    way = std::max(way, one.way);
    turn = std::max(turn, one.turn);
  }
  const double fast = std::max(kFastest, kThanBefore * before.way / before.seconds);
  const double fast_turn = std::max(kFastestTurn, kThanBefore * before.turn / before.seconds);
  return (step.way > std::max(kShortestJump, kThanBefore * way) && step.way > fast * step.seconds) ||
         (step.turn > std::max(kSmallestTurn, kThanBefore * turn) && step.turn > fast_turn * step.seconds);
}

void OdometryContinuity::Remember(const Step& step) {
  steps_.push_back(step);
  if (steps_.size() > kRemembered) steps_.pop_front();
  if (jumped_from_rest_ && std::max(step.way, step.turn) > kInMotion * step.seconds) {
    ++counted_["odometry that stood still before it jumped into motion"];
    worthless_start_ = true;
  }
  worthless_start_ = worthless_start_ || only_jumped_;
  jumped_from_rest_ = only_jumped_ = false;
  moved_ = moved_ || std::max(step.way, step.turn) > kAtRest;
}

bool OdometryContinuity::TakeWorthlessStart() { return std::exchange(worthless_start_, false); }

std::optional<OdometryReading> OdometryContinuity::Push(const OdometryReading& reading) {
  if (!IsUsable(reading.T_odom_base)) {
    ++counted_["odometry not finite"];
    return std::nullopt;
  }
  if (!last_.has_value()) {
    last_ = reading;
    return reading;
  }
  const double seconds = SecondsBetween(last_->stamp, reading.stamp);
  if (seconds <= 0.0) return reading;
  const Rigid2 step = last_->T_odom_base.Inverse() * reading.T_odom_base;
  const Step measures{step.translation.norm(), std::abs(step.angle), seconds};
  const bool jump = IsJump(measures);
  if (jump) {
    ++counted_["odometry that jumped"];
    jumped_ = true;
    only_jumped_ = steps_.empty();
    jumped_from_rest_ = !moved_ && !only_jumped_;
    const Rigid2 bridge = seconds < kLongestBridge ? ExpSe2(seconds * velocity_) : Rigid2();
    T_here_odom_ = T_here_odom_ * last_->T_odom_base * bridge * reading.T_odom_base.Inverse();
  } else {
    Remember(measures);
    velocity_ = LogSe2(step) / seconds;
  }
  last_ = reading;
  OdometryReading continued = reading;
  if (jumped_) continued.T_odom_base = T_here_odom_ * reading.T_odom_base;
  if (jump) continued.covariance_rate.reset();
  return continued;
}

}  // namespace planar_vslam
