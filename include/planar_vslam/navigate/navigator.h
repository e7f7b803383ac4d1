#pragma once
// Drives a robot to a goal: costmap, plan, controller, recovery and supervisor put together, one step at a time.
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/navigate/among_people.h"
#include "planar_vslam/navigate/global_planner.h"
#include "planar_vslam/navigate/local_controller.h"
#include "planar_vslam/navigate/people_watch.h"
#include "planar_vslam/navigate/recovery.h"
#include "planar_vslam/navigate/supervisor.h"
#include "planar_vslam/navigate/visit.h"

namespace planar_vslam {

enum class GoalState { kNone, kDriving, kReached, kAborted };

struct NavigatorInput {
  double time = 0.0;  // s, now
  Rigid2 T_map_base, T_odom_base;
  double transform_age = 0.0;          // s, of the first
  std::optional<PoseQuality> quality;  // as Vitals has it
  bool new_quality = false;
  PoseSource source = PoseSource::kUnsaid;
};

struct NavigatorOutput {
  GoalState state = GoalState::kNone;
  PlaneVelocity velocity;
  std::string text;  // why it stands, or why it gave up; what recovery does
  bool new_path = false;
};

class Navigator {
 public:
  // `options` have no problems.
  explicit Navigator(const NavigateOptions& options);

  Costmap& costmap() { return costmap_; }
  const Costmap& costmap() const { return costmap_; }
  const std::vector<Eigen::Vector2d>& path() const { return controller_.path(); }
  const PeopleWatch& people() const { return people_; }
  // The laser's newest sweep, and where the robot was at its stamp (s). Without a pose in the map it still stops the
  // robot, but marks nothing.
  void AddSweep(double stamp, const PlanarScan& scan, const Rigid2& T_base_laser, const Rigid2& T_odom_base,
                const std::optional<Rigid2>& T_map_base);

  // Replaces a goal that is being driven to. One that is not finite is aborted by the next step.
  void SetGoal(const Rigid2& T_map_goal);
  void Cancel();
  // At the controller's rate. After kReached or kAborted the state is kNone.
  NavigatorOutput Step(const NavigatorInput& input);

 private:
  NavigatorOutput Drive(const NavigatorInput& input);
  NavigatorOutput DriveAlone(const NavigatorInput& input, const Surroundings& surroundings);
  // What driving alone gave, adapted to people who walk.
  NavigatorOutput AmongPeople(const NavigatorInput& input, const Surroundings& surroundings, NavigatorOutput output);
  Intention IntentionOf(const NavigatorInput& input, const PlaneVelocity& wanted) const;
  // Where the robot is to drive: the goal, or where it waits beside people's way until it can visit the goal.
  const Rigid2& Target() const { return visit_.has_value() ? visit_->T_map_wait : *T_map_goal_; }
  bool IsWaiting() const { return visit_.has_value() && control_.state == ControlState::kArrived; }
  void SeekVisit(const NavigatorInput& input);
  void BeginVisit(std::optional<Visit> visit, double time);
  Foresight ForeseeVisit(double time) const;
  bool MayGoIn(const NavigatorInput& input) const;
  std::optional<NavigatorOutput> GoIn(const NavigatorInput& input, const Surroundings& surroundings);
  NavigatorOutput OnBlocked(const NavigatorInput& input, const std::string& reason);
  NavigatorOutput Finish(GoalState state, std::string text);
  NavigatorOutput Stand(std::string text);
  NavigatorOutput Hold(const Permission& permission);
  Permission CheckVitals(const NavigatorInput& input);
  // False where no way is left, whatever the laser sees.
  bool Replan(const NavigatorInput& input, NavigatorOutput* output);
  double PeriodOf(const NavigatorInput& input) const;
  void ForgetAfterAJump(const Rigid2& T_odom_base, const Rigid2& T_map_base);
  Surroundings SurroundingsAt(const NavigatorInput& input) const;

  NavigateOptions options_;
  Costmap costmap_;
  LocalController controller_;
  Recovery recovery_;
  Supervisor supervisor_;
  PeopleWatch people_;
  std::optional<Rigid2> T_map_goal_, T_map_odom_;
  bool goal_is_new_ = false;
  Control control_;                                           // the last
  double nearest_ = 0.0;                                      // m of way that were left, at least
  std::optional<double> kept_since_;                          // s, by people, from getting nearer
  std::optional<Visit> visit_;                                // to the goal, where people walk over it
  bool visiting_ = false;                                     // it is on its way in
  int doubts_ = 0;                                            // steps in a row there that foresaw a contact
  std::optional<double> sought_at_;                           // s, a visit
  double seen_at_ = 0.0;                                      // s, somebody who walks
  bool arrived_ = false;                                      // by a pose that may have to be confirmed yet
  std::string no_plan_;                                       // why the last plan failed; empty: it did not
  std::optional<double> planned_at_, swept_at_, stepped_at_;  // s
  std::vector<Eigen::Vector2d> points_odom_;                  // of the last sweep, m
  PlaneVelocity velocity_;                                    // sent last
};

}  // namespace planar_vslam
