#pragma once
// Follows a path: pure pursuit (Coulter, 1992) of the farthest point ahead that an arc of the body reaches freely. The
// speed lets the robot brake in front of what is on the arc, of the goal, and of the next turn in place. At the goal it
// turns to the goal's heading.
#include <Eigen/Core>
#include <vector>

#include "planar_vslam/navigate/surroundings.h"

namespace planar_vslam {

enum class ControlState { kDriving, kTurning, kArrived, kBlocked };

struct Control {
  ControlState state = ControlState::kBlocked;
  PlaneVelocity velocity;  // to be sent to the base
  double turn = 0.0;       // rad in place, to the left, before it goes on
};

class LocalController {
 public:
  explicit LocalController(const NavigateOptions& options) : options_(options) {}

  // `keep` where the goal stays and only the way there is a new one.
  void SetPath(std::vector<Eigen::Vector2d> path, const Rigid2& T_map_goal, bool keep);
  // `velocity` is the last one that was sent, `period` (s) the time since then.
  Control Step(const Rigid2& T_map_base, const Surroundings& surroundings, const PlaneVelocity& velocity,
               double period);
  // Metres along the path; 0 without one.
  double Remaining(const Rigid2& T_map_base) const;
  // The path from the robot on: at most `count` places, `spacing` (m) apart, the robot's own first.
  std::vector<Eigen::Vector2d> Ahead(const Rigid2& T_map_base, double spacing, int count) const;
  // Whether the goal is reached but for its heading.
  bool at_goal() const { return at_goal_; }
  const std::vector<Eigen::Vector2d>& path() const { return path_; }

 private:
  std::size_t NearestIndex(const Eigen::Vector2d& p_map) const;
  Eigen::Vector2d CarrotAt(const Eigen::Vector2d& p_map, double distance) const;
  bool IsAtGoal(const Rigid2& T_map_base);
  Control TurnTo(double error, const PlaneVelocity& velocity, double period) const;
  Control Drive(const Rigid2& T_map_base, const Surroundings& surroundings, const PlaneVelocity& velocity,
                double period);
  PlaneVelocity Toward(const Eigen::Vector2d& p_base, double heading_error) const;
  double SpeedBefore(double distance) const;

  NavigateOptions options_;
  std::vector<Eigen::Vector2d> path_;  // map, m
  Rigid2 T_map_goal_;
  bool at_goal_ = false;  // there but for the heading
  bool turning_ = false;  // in place, towards the path
  double nearest_ = 0.0;  // m, closest to the goal so far
};

}  // namespace planar_vslam
