#include "planar_vslam/navigate/navigator.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace planar_vslam {
namespace {

constexpr double kFirstPeriod = 0.1;  // s, of a step that has none before it
// Of the pose against odometry: what puts marks on the wrong side of a wall, or across a door.
constexpr double kJump = 0.2, kJumpAngle = 0.1;  // m, rad
constexpr double kLookRate = 0.3;                // rad/s: images must not blur

bool IsFinite(const Rigid2& T) { return T.translation.allFinite() && std::isfinite(T.angle); }

}  // namespace

Navigator::Navigator(const NavigateOptions& options)
    : options_(options), costmap_(options), controller_(options), recovery_(options), supervisor_(options) {
  PV_CHECK(options.Problems().empty(), "options with problems");
}

void Navigator::AddSweep(double stamp, const PlanarScan& scan, const Rigid2& T_base_laser, const Rigid2& T_odom_base,
                         const std::optional<Rigid2>& T_map_base) {
  swept_at_ = stamp;
  points_odom_ = PointsOf(scan, T_base_laser);
  for (Eigen::Vector2d& point : points_odom_) point = T_odom_base * point;
  if (!T_map_base.has_value()) return;
  ForgetMarksAfterAJump(T_odom_base, *T_map_base);
  costmap_.AddSweep(stamp, *T_map_base * T_base_laser, scan);
}

// They are where the robot was not.
void Navigator::ForgetMarksAfterAJump(const Rigid2& T_odom_base, const Rigid2& T_map_base) {
  if (T_map_odom_.has_value()) {
    const Rigid2 step = (*T_map_odom_ * T_odom_base).Inverse() * T_map_base;
    if (step.translation.norm() > kJump || std::abs(step.angle) > kJumpAngle) costmap_.ClearMarks();
  }
  T_map_odom_ = T_map_base * T_odom_base.Inverse();
}

void Navigator::SetGoal(const Rigid2& T_map_goal) {
  T_map_goal_ = T_map_goal;
  goal_is_new_ = true;
  arrived_ = false;
  planned_at_.reset();
  no_plan_.clear();
  recovery_.Reset();
  supervisor_.Reset();
}

void Navigator::Cancel() {
  T_map_goal_.reset();
  velocity_ = {};
  controller_.SetPath({}, {}, false);
}

NavigatorOutput Navigator::Finish(GoalState state, std::string text) {
  Cancel();
  return {state, {}, std::move(text), false};
}

NavigatorOutput Navigator::Stand(std::string text) {
  velocity_ = {};
  return {GoalState::kDriving, {}, std::move(text), false};
}

Surroundings Navigator::SurroundingsAt(const NavigatorInput& input) const {
  const Rigid2 T_base_odom = input.T_odom_base.Inverse();
  // What is farther away is in nobody's way within a braking distance.
  const double reach = options_.robot_radius + options_.mark_range;
  std::vector<Eigen::Vector2d> points;
  for (const Eigen::Vector2d& p_odom : points_odom_) {
    const Eigen::Vector2d p_base = T_base_odom * p_odom;
    if (p_base.norm() < reach) points.push_back(p_base);
  }
  return {costmap_, options_, input.T_map_base, std::move(points)};
}

Permission Navigator::CheckVitals(const NavigatorInput& input) {
  Vitals vitals;
  vitals.time = input.time;
  vitals.transform_age = IsFinite(input.T_map_base) && IsFinite(input.T_odom_base)
                             ? input.transform_age
                             : std::numeric_limits<double>::infinity();
  vitals.scan_age = swept_at_.has_value() ? input.time - *swept_at_ : std::numeric_limits<double>::infinity();
  vitals.quality = input.quality;
  vitals.new_quality = input.new_quality;
  vitals.source = input.source;
  vitals.arrived = arrived_;
  vitals.T_odom_base = input.T_odom_base;
  vitals.commanded = velocity_;
  return supervisor_.Check(vitals);
}

NavigatorOutput Navigator::Hold(const Permission& permission) {
  planned_at_.reset();  // plan anew before driving on
  NavigatorOutput output = Stand(permission.reason);
  if (permission.look_round) output.velocity.yaw = std::min(kLookRate, options_.max_turn_rate);
  velocity_ = output.velocity;
  return output;
}

NavigatorOutput Navigator::Step(const NavigatorInput& input) {
  if (!T_map_goal_.has_value()) return {};
  if (!IsFinite(*T_map_goal_)) return Finish(GoalState::kAborted, "the goal is not a finite pose");
  const Permission permission = CheckVitals(input);
  if (permission.kind == Permission::Kind::kGiveUp) return Finish(GoalState::kAborted, permission.reason);
  if (permission.kind == Permission::Kind::kHold) return Hold(permission);
  NavigatorOutput output = Drive(input);
  stepped_at_ = input.time;
  velocity_ = output.velocity;
  return output;
}

bool Navigator::Replan(const NavigatorInput& input, NavigatorOutput* output) {
  if (planned_at_.has_value() && input.time - *planned_at_ < options_.replan_period) return true;
  planned_at_ = input.time;
  const Eigen::Vector2d start = input.T_map_base.translation, goal = T_map_goal_->translation;
  Plan plan = PlanPath(costmap_, options_, start, goal);
  no_plan_ = plan.reason;
  if (plan.found()) {
    controller_.SetPath(std::move(plan.path), *T_map_goal_, !goal_is_new_);
    goal_is_new_ = false;
    output->new_path = true;
    return true;
  }
  // What the laser sees may go away; what the map says will not.
  const Plan without_laser = PlanPath(costmap_, options_, start, goal, Layers::kMapOnly);
  if (without_laser.found() || without_laser.status == PlanStatus::kStartBlocked) return true;
  no_plan_ = without_laser.reason;
  return false;
}

NavigatorOutput Navigator::Drive(const NavigatorInput& input) {
  NavigatorOutput output;
  output.state = GoalState::kDriving;
  const Surroundings surroundings = SurroundingsAt(input);
  if (recovery_.active()) {
    output.velocity = recovery_.Step(input.time, input.T_odom_base, surroundings);
    planned_at_.reset();
    return output;
  }
  if (!Replan(input, &output)) return Finish(GoalState::kAborted, no_plan_);
  if (!no_plan_.empty()) return OnBlocked(input, no_plan_);
  const double period = stepped_at_.has_value() ? std::clamp(input.time - *stepped_at_, 0.0, 0.5) : kFirstPeriod;
  const Control control = controller_.Step(input.T_map_base, surroundings, velocity_, period);
  arrived_ = control.state == ControlState::kArrived;
  if (arrived_ && input.source != PoseSource::kWheels) return Finish(GoalState::kReached, "");
  if (arrived_) return Stand("");  // what the wheels say is to be confirmed first
  if (control.state == ControlState::kBlocked) return OnBlocked(input, "something is in the way");
  recovery_.Driving(input.T_odom_base);
  output.velocity = control.velocity;
  return output;
}

NavigatorOutput Navigator::OnBlocked(const NavigatorInput& input, const std::string& reason) {
  const RecoveryAction action = recovery_.Blocked(input.time, input.T_odom_base);
  if (action == RecoveryAction::kGiveUp) return Finish(GoalState::kAborted, reason + "; recovery did not help");
  if (action == RecoveryAction::kNone) return Stand(reason);
  if (action == RecoveryAction::kClear) costmap_.ClearMarks();
  planned_at_.reset();
  return Stand(reason + ": " + ToString(action));
}

}  // namespace planar_vslam
