#include "planar_vslam/navigate/navigator.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "planar_vslam/navigate/turning.h"

namespace planar_vslam {
namespace {

constexpr double kFirstPeriod = 0.1;  // s, of a step that has none before it
// Of the pose against odometry: what puts marks on the wrong side of a wall, or across a door.
constexpr double kJump = 0.2, kJumpAngle = 0.1;  // m, rad
constexpr double kLookRate = 0.3;                // rad/s: images must not blur
// Chosen by looking at seeds 1, 3 and 4 of mechatronics_lab. Of visits: goals that the speed plan alone does not reach,
// since it knows straight ways in and no way out.
constexpr double kVisitsAfter = 10.0;               // s that people keep it from getting nearer
constexpr double kSeeks = 2.0, kSeeksAgain = 30.0;  // s between two searches, without a visit and with one
constexpr double kLeastGap = 0.05, kGoodGap = 0.2;  // m to who comes by: to go in, and to go in at once
constexpr double kSoon = 1.0, kBetter = 0.01;       // s, m: a gap that is so much wider so soon is waited for
constexpr double kGoneFor = 5.0;                    // s, until who is no longer seen is gone
constexpr int kMostDoubts = 2;                      // steps in a row that foresee a contact; one is noise
constexpr double kNearer = 0.5;                     // m: so much less way is progress

bool IsFinite(const Rigid2& T) { return T.translation.allFinite() && std::isfinite(T.angle); }

}  // namespace

Navigator::Navigator(const NavigateOptions& options)
    : options_(options),
      costmap_(options),
      controller_(options),
      recovery_(options),
      supervisor_(options),
      people_(options) {
  PV_CHECK(options.Problems().empty(), "options with problems");
}

void Navigator::AddSweep(double stamp, const PlanarScan& scan, const Rigid2& T_base_laser, const Rigid2& T_odom_base,
                         const std::optional<Rigid2>& T_map_base) {
  swept_at_ = stamp;
  std::vector<std::size_t> beams;  // that end at people who walk
  if (T_map_base.has_value()) {
    ForgetAfterAJump(T_odom_base, *T_map_base);
    beams = people_.AddSweep(stamp, scan, *T_map_base * T_base_laser, costmap_);
    costmap_.AddSweep(stamp, *T_map_base * T_base_laser, scan, beams);
  }
  PlanarScan without_people = scan;
  for (const std::size_t beam : beams) without_people.ranges[beam] = std::numeric_limits<float>::quiet_NaN();
  points_odom_ = PointsOf(without_people, T_base_laser);
  for (Eigen::Vector2d& point : points_odom_) point = T_odom_base * point;
}

// They are where the robot was not.
void Navigator::ForgetAfterAJump(const Rigid2& T_odom_base, const Rigid2& T_map_base) {
  if (T_map_odom_.has_value()) {
    const Rigid2 step = (*T_map_odom_ * T_odom_base).Inverse() * T_map_base;
    if (step.translation.norm() > kJump || std::abs(step.angle) > kJumpAngle) {
      costmap_.ClearMarks();
      people_.Forget();
    }
  }
  T_map_odom_ = T_map_base * T_odom_base.Inverse();
}

void Navigator::SetGoal(const Rigid2& T_map_goal) {
  T_map_goal_ = T_map_goal;
  goal_is_new_ = true;
  arrived_ = false;
  kept_since_.reset();
  planned_at_.reset();
  no_plan_.clear();
  recovery_.Reset();
  supervisor_.Reset();
  visit_.reset();
  visiting_ = false;
  sought_at_.reset();
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
  const Eigen::Vector2d start = input.T_map_base.translation, goal = Target().translation;
  Plan plan = PlanPath(costmap_, options_, start, goal, Layers::kMapAndLaser, people_.CostOfWays(input.time, costmap_));
  no_plan_ = plan.reason;
  if (plan.found()) {
    controller_.SetPath(std::move(plan.path), Target(), !goal_is_new_);
    goal_is_new_ = false;
    output->new_path = true;
    return true;
  }
  if (visit_.has_value()) {
    BeginVisit(std::nullopt, input.time);
    return Replan(input, output);
  }
  // What the laser sees may go away; what the map says will not.
  const Plan without_laser = PlanPath(costmap_, options_, start, goal, Layers::kMapOnly);
  if (without_laser.found() || without_laser.status == PlanStatus::kStartBlocked) return true;
  no_plan_ = without_laser.reason;
  return false;
}

double Navigator::PeriodOf(const NavigatorInput& input) const {
  return stepped_at_.has_value() ? std::clamp(input.time - *stepped_at_, 0.0, 0.5) : kFirstPeriod;
}

NavigatorOutput Navigator::Drive(const NavigatorInput& input) {
  const Surroundings surroundings = SurroundingsAt(input);
  if (visiting_) {
    const std::optional<NavigatorOutput> output = GoIn(input, surroundings);
    if (output.has_value()) return *output;
  }
  return AmongPeople(input, surroundings, DriveAlone(input, surroundings));
}

NavigatorOutput Navigator::DriveAlone(const NavigatorInput& input, const Surroundings& surroundings) {
  NavigatorOutput output;
  output.state = GoalState::kDriving;
  control_ = {};
  if (recovery_.active()) {
    output.velocity = recovery_.Step(input.time, input.T_odom_base, surroundings);
    planned_at_.reset();
    return output;
  }
  if (!Replan(input, &output)) return Finish(GoalState::kAborted, no_plan_);
  if (!no_plan_.empty()) return OnBlocked(input, no_plan_);
  control_ = controller_.Step(input.T_map_base, surroundings, velocity_, PeriodOf(input));
  if (IsWaiting()) return output;
  arrived_ = control_.state == ControlState::kArrived;
  if (arrived_ && input.source != PoseSource::kWheels) return Finish(GoalState::kReached, "");
  if (arrived_) return Stand("");  // what the wheels say is to be confirmed first
  if (control_.state == ControlState::kBlocked) return OnBlocked(input, "something is in the way");
  recovery_.Driving(input.T_odom_base);
  output.velocity = control_.velocity;
  return output;
}

Intention Navigator::IntentionOf(const NavigatorInput& input, const PlaneVelocity& wanted) const {
  Intention intention;
  intention.velocity = wanted;
  if (!visit_.has_value() && people_.IsWalked(T_map_goal_->translation))
    intention.gaps_out = GapsOut(*T_map_goal_, ForeseeVisit(input.time), options_, costmap_);
  const double remaining = controller_.Remaining(input.T_map_base);
  const bool goes_on = control_.state == ControlState::kDriving || control_.state == ControlState::kTurning;
  if (!goes_on) {
    intention.path = {input.T_map_base.translation};
    intention.beyond = std::max(remaining, options_.goal_tolerance);
    return intention;
  }
  if (controller_.at_goal()) {
    intention.path = {input.T_map_base.translation};
    intention.hold = TurnTime(options_, std::abs(control_.turn)) + Visit::kStay;
    return intention;
  }
  const double spacing = SpeedStep(options_);
  intention.path = controller_.Ahead(input.T_map_base, spacing, SpeedPlaces(options_));
  intention.beyond = remaining - spacing * static_cast<double>(intention.path.size() - 1);
  intention.turn = control_.turn;
  const Eigen::Vector2d& end = intention.path.back();
  const Eigen::Vector2d before =
      intention.path[intention.path.size() - std::min<std::size_t>(intention.path.size(), 15)];
  const Eigen::Vector2d way = end - before;
  const double heading = way.norm() > 0.0 ? std::atan2(way.y(), way.x()) : input.T_map_base.angle;
  intention.hold = TurnTime(options_, std::abs(WrapAngle(Target().angle - heading))) + Visit::kStay;
  return intention;
}

NavigatorOutput Navigator::AmongPeople(const NavigatorInput& input, const Surroundings& surroundings,
                                       NavigatorOutput output) {
  const Foresight foresight = people_.ForeseeFrom(input.time, options_.foresight, costmap_);
  if (output.state != GoalState::kDriving || foresight.empty()) {
    if (!visit_.has_value()) kept_since_.reset();
    if (visit_.has_value() && input.time - seen_at_ > kGoneFor) BeginVisit(std::nullopt, input.time);
    return output;
  }
  seen_at_ = input.time;
  const auto is_walked = [this](const Eigen::Vector2d& p) { return people_.IsWalked(p); };
  const Adapted adapted = AdaptToPeople(IntentionOf(input, output.velocity), foresight, options_, costmap_,
                                        surroundings, is_walked, input.T_map_base, velocity_, PeriodOf(input));
  output.velocity = adapted.velocity;
  const double remaining = controller_.Remaining(input.T_map_base);
  if (!kept_since_.has_value() || (!visit_.has_value() && remaining < nearest_ - kNearer)) {
    kept_since_ = input.time;
    nearest_ = remaining;
  }
  SeekVisit(input);
  if (IsWaiting() && adapted.action != PeopleAction::kGiveWay) visiting_ = MayGoIn(input);
  if (adapted.action == PeopleAction::kNone && !IsWaiting()) return output;
  if (input.time - *kept_since_ > options_.people_patience)
    return Finish(GoalState::kAborted, "people who walk keep the robot from the goal");
  output.text = adapted.action != PeopleAction::kGiveWay ? "waits for somebody who walks" : "gives way to somebody";
  return output;
}

void Navigator::BeginVisit(std::optional<Visit> visit, double time) {
  visit_ = std::move(visit);
  visiting_ = false;
  doubts_ = 0;
  sought_at_ = time;
  planned_at_.reset();
  goal_is_new_ = true;
}

Foresight Navigator::ForeseeVisit(double time) const { return people_.ForeseeFrom(time, Visit::kForesight, costmap_); }

void Navigator::SeekVisit(const NavigatorInput& input) {
  if (input.time - *kept_since_ < kVisitsAfter || !people_.IsWalked(T_map_goal_->translation)) return;
  if (sought_at_.has_value() && input.time - *sought_at_ < (visit_.has_value() ? kSeeksAgain : kSeeks)) return;
  const Foresight foresight = ForeseeVisit(input.time);
  if (!foresight.steady) return;
  sought_at_ = input.time;
  std::optional<Visit> found = FindVisit(*T_map_goal_, foresight, options_, costmap_, input.T_map_base, kLeastGap);
  if (found.has_value()) BeginVisit(std::move(found), input.time);
}

bool Navigator::MayGoIn(const NavigatorInput& input) const {
  const Foresight foresight = ForeseeVisit(input.time);
  // Who is out of sight for longer is not gone, and who keeps no time comes at any.
  if (foresight.empty() || !foresight.steady) return false;
  const auto gap = [&](double delay) {
    return GapOfVisit(*visit_, foresight, options_, costmap_, input.T_map_base, velocity_, delay);
  };
  const double now = gap(0.0);
  if (now < kLeastGap) return false;
  for (double delay = Foresight::kPeriod; delay <= kSoon && now < kGoodGap; delay += Foresight::kPeriod) {
    if (gap(delay) > now + kBetter) return false;
  }
  return true;
}

// None: it cannot go on.
std::optional<NavigatorOutput> Navigator::GoIn(const NavigatorInput& input, const Surroundings& surroundings) {
  const Foresight foresight = ForeseeVisit(input.time);
  const VisitStep step = StepVisit(*visit_, options_, input.T_map_base, velocity_, PeriodOf(input));
  const double speed = step.velocity.Speed();
  const double braking = speed * (options_.reaction_time + 0.5 * speed / options_.acceleration);
  const bool blocked = speed > 0.0 && surroundings.FreeLength(step.velocity, braking) < braking;
  const bool doubtful = blocked || foresight.empty() ||
                        GapOfVisit(*visit_, foresight, options_, costmap_, input.T_map_base, velocity_, 0.0) < 0.0;
  doubts_ = doubtful ? doubts_ + 1 : 0;
  const double off = (T_map_goal_->translation - input.T_map_base.translation).norm();
  arrived_ = step.there && off <= options_.goal_tolerance;
  if (doubts_ > kMostDoubts || (step.there && !arrived_)) {
    BeginVisit(std::nullopt, input.time);
    return std::nullopt;
  }
  if (arrived_ && input.source != PoseSource::kWheels) return Finish(GoalState::kReached, "");
  if (arrived_ || blocked) return Stand("");
  NavigatorOutput output;
  output.state = GoalState::kDriving;
  output.velocity = step.velocity;
  output.text = "goes in between two passes of somebody";
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
