#include "planar_vslam/navigate/supervisor.h"

#include <fmt/format.h>

#include <cmath>

namespace planar_vslam {
namespace {

// Of what is commanded, in m/s and rad/s: less a base may not follow.
constexpr double kMoves = 0.03, kTurns = 0.06;
// Of what the base does in all that time, in m and rad.
constexpr double kMoved = 0.02, kTurned = 0.05;

}  // namespace

// What the robot cannot mend by looking round.
std::string Supervisor::ReasonToHold(const Vitals& vitals) const {
  if (vitals.scan_age <= options_.max_scan_age) return "";
  if (!std::isfinite(vitals.scan_age)) return "the laser has not said anything yet";
  return fmt::format("the laser is silent for {:.1f} s (limit {:.1f} s)", vitals.scan_age, options_.max_scan_age);
}

std::string Supervisor::ReasonToDoubt(const Vitals& vitals) const {
  if (vitals.source == PoseSource::kNothing) return "localisation does not know the place";
  if (!(vitals.transform_age <= options_.max_transform_age))
    return std::isfinite(vitals.transform_age) ? fmt::format("the pose in the map is {:.1f} s old (limit {:.1f} s)",
                                                             vitals.transform_age, options_.max_transform_age)
                                               : "there is no pose in the map";
  if (driven_unconfirmed_ > options_.max_drive_unconfirmed)
    return fmt::format("nothing but the wheels told the pose for {:.1f} m of driving (limit {:.1f} m)",
                       driven_unconfirmed_, options_.max_drive_unconfirmed);
  if (vitals.arrived && vitals.source == PoseSource::kWheels) return "at the goal by what the wheels say";
  if (!vitals.quality.has_value()) return "";
  const PoseQuality& quality = *vitals.quality;
  if (!(quality.position_deviation <= options_.max_position_deviation))
    return fmt::format("localisation is too uncertain: standard deviation {:.2f} m (limit {:.2f} m)",
                       quality.position_deviation, options_.max_position_deviation);
  if (!(quality.heading_deviation <= options_.max_heading_deviation))
    return fmt::format("localisation is too uncertain: standard deviation {:.0f} deg (limit {:.0f} deg)",
                       RadiansToDegrees(quality.heading_deviation), RadiansToDegrees(options_.max_heading_deviation));
  if (driven_without_pose_ > options_.max_drive_without_pose)
    return fmt::format("no message on pose for {:.1f} m of driving (limit {:.1f} m)", driven_without_pose_,
                       options_.max_drive_without_pose);
  return "";
}

bool Supervisor::IsStuck(const Vitals& vitals) {
  const bool told = vitals.commanded.Speed() > kMoves || std::abs(vitals.commanded.yaw) > kTurns;
  const bool moved = (vitals.T_odom_base.translation - T_odom_told_.translation).norm() > kMoved ||
                     std::abs(WrapAngle(vitals.T_odom_base.angle - T_odom_told_.angle)) > kTurned;
  if (!told) {
    told_since_.reset();
    return false;
  }
  if (!told_since_.has_value() || moved) {
    told_since_ = vitals.time;
    T_odom_told_ = vitals.T_odom_base;
  }
  return vitals.time - *told_since_ > options_.stuck_time;
}

void Supervisor::CountDistance(const Vitals& vitals) {
  const double step = has_last_ ? (vitals.T_odom_base.translation - T_odom_last_.translation).norm() : 0.0;
  driven_without_pose_ = has_last_ && !vitals.new_quality ? driven_without_pose_ + step : 0.0;
  const bool carried_along = vitals.source == PoseSource::kWheels || vitals.source == PoseSource::kNothing;
  driven_unconfirmed_ = carried_along ? driven_unconfirmed_ + step : 0.0;
  T_odom_last_ = vitals.T_odom_base;
  has_last_ = true;
}

Permission Supervisor::Check(const Vitals& vitals) {
  CountDistance(vitals);
  if (IsStuck(vitals)) {
    return {Permission::Kind::kGiveUp,
            fmt::format("the robot does not move though told to for {:.1f} s (limit {:.1f} s)",
                        vitals.time - *told_since_, options_.stuck_time)};
  }
  Permission permission{Permission::Kind::kHold, ReasonToHold(vitals)};
  if (permission.reason.empty()) {
    permission.reason = ReasonToDoubt(vitals);
    // Where nobody says what tells the pose, nobody may expect that turning helps.
    permission.look_round = vitals.source != PoseSource::kUnsaid;
  }
  if (permission.reason.empty()) {
    held_since_.reset();
    return {};
  }
  if (!held_since_.has_value()) held_since_ = vitals.time;
  if (vitals.time - *held_since_ >= options_.hold_limit) permission.kind = Permission::Kind::kGiveUp;
  return permission;
}

void Supervisor::Reset() {
  held_since_.reset();
  told_since_.reset();
  has_last_ = false;
}

}  // namespace planar_vslam
