#include "planar_vslam/navigate/local_controller.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace planar_vslam {
namespace {

constexpr double kCloseEnough = 0.03;  // m: no base stops more exactly
constexpr double kSlowest = 0.04;      // m/s: what wheels still follow
constexpr double kSlowestTurn = 0.08;  // rad/s
constexpr double kAligned = 0.15;      // rad, where a turn in place towards the path ends

double Approach(double from, double to, double most) { return std::clamp(to, from - most, from + most); }

}  // namespace

void LocalController::SetPath(std::vector<Eigen::Vector2d> path, const Rigid2& T_map_goal, bool keep) {
  path_ = std::move(path);
  T_map_goal_ = T_map_goal;
  if (keep) return;
  at_goal_ = turning_ = false;
  nearest_ = std::numeric_limits<double>::infinity();
}

std::size_t LocalController::NearestIndex(const Eigen::Vector2d& p_map) const {
  std::size_t best = 0;
  for (std::size_t i = 1; i < path_.size(); ++i) {
    if ((path_[i] - p_map).squaredNorm() < (path_[best] - p_map).squaredNorm()) best = i;
  }
  return best;
}

double LocalController::Remaining(const Rigid2& T_map_base) const {
  if (path_.empty()) return 0.0;
  const std::size_t nearest = NearestIndex(T_map_base.translation);
  double length = (path_[nearest] - T_map_base.translation).norm();
  for (std::size_t i = nearest; i + 1 < path_.size(); ++i) length += (path_[i + 1] - path_[i]).norm();
  return length;
}

std::vector<Eigen::Vector2d> LocalController::Ahead(const Rigid2& T_map_base, double spacing, int count) const {
  std::vector<Eigen::Vector2d> places{T_map_base.translation};
  if (path_.empty()) return places;
  Eigen::Vector2d at = T_map_base.translation;
  for (std::size_t i = NearestIndex(at); i < path_.size();) {
    const Eigen::Vector2d way = path_[i] - at;
    const double length = way.norm(), needed = spacing - (at - places.back()).norm();
    if (length < needed) {
      at = path_[i++];
      continue;
    }
    at += way * (needed / length);
    places.push_back(at);
    if (static_cast<int>(places.size()) >= count) break;
  }
  return places;
}

// The last point of the path that is within `distance`, from the nearest on.
Eigen::Vector2d LocalController::CarrotAt(const Eigen::Vector2d& p_map, double distance) const {
  std::size_t i = NearestIndex(p_map);
  while (i + 1 < path_.size() && (path_[i] - p_map).norm() < distance) ++i;
  return path_[i];
}

bool LocalController::IsAtGoal(const Rigid2& T_map_base) {
  const double distance = (T_map_goal_.translation - T_map_base.translation).norm();
  nearest_ = std::min(nearest_, distance);
  if (at_goal_) {
    at_goal_ = distance <= options_.goal_tolerance;
    return at_goal_;
  }
  // Nearer than that is better, as long as it still comes nearer.
  constexpr double kReceding = 0.01;  // m
  at_goal_ = distance <= kCloseEnough || (distance <= 0.7 * options_.goal_tolerance && distance > nearest_ + kReceding);
  return at_goal_;
}

double LocalController::SpeedBefore(double distance) const {
  // v^2 / (2 a) + v t = d
  const double at = options_.acceleration * options_.reaction_time;
  return std::sqrt(at * at + 2.0 * options_.acceleration * std::max(0.0, distance)) - at;
}

Control LocalController::TurnTo(double error, const PlaneVelocity& velocity, double period) const {
  // Half the acceleration leaves room for a base that obeys late.
  const double most = std::min(options_.max_turn_rate, std::sqrt(options_.turn_acceleration * std::abs(error)));
  const double wanted = std::copysign(std::max(kSlowestTurn, std::min(most, 2.0 * std::abs(error))), error);
  const double yaw = Approach(velocity.yaw, wanted, options_.turn_acceleration * period);
  return {ControlState::kTurning, {0.0, 0.0, yaw}, error};
}

// A velocity of full speed whose arc leads to a point.
PlaneVelocity LocalController::Toward(const Eigen::Vector2d& p_base, double heading_error) const {
  const double distance = p_base.norm();
  if (distance <= 0.0) return {};
  if (options_.omnidirectional) {
    const Eigen::Vector2d direction = p_base / distance;
    const double speed = std::min(options_.max_speed / std::max(1e-6, std::abs(direction.x())),
                                  options_.max_sideways_speed / std::max(1e-6, std::abs(direction.y())));
    const double yaw = std::clamp(heading_error, -options_.max_turn_rate, options_.max_turn_rate);
    return {direction.x() * speed, direction.y() * speed, yaw};
  }
  const double curvature = 2.0 * p_base.y() / (distance * distance);
  const double speed = std::min(options_.max_speed, options_.max_turn_rate / std::max(1e-6, std::abs(curvature)));
  return {speed, 0.0, curvature * speed};
}

Control LocalController::Drive(const Rigid2& T_map_base, const Surroundings& surroundings,
                               const PlaneVelocity& velocity, double period) {
  const Rigid2 T_base_map = T_map_base.Inverse();
  const double remaining = Remaining(T_map_base);
  PlaneVelocity best;
  double best_speed = 0.0;
  // Shorter arcs cut fewer corners. Each is about two thirds of the one before, down to two or three cells of the path:
  // below that, the rounding to cells decides the bearing. Other ladders have not been tried.
  for (const double share : {1.0, 0.7, 0.45, 0.25}) {
    const Eigen::Vector2d carrot = T_base_map * CarrotAt(T_map_base.translation, share * options_.lookahead);
    const double bearing = std::atan2(carrot.y(), carrot.x());
    const bool sideways = options_.omnidirectional && remaining < options_.lookahead;
    const double goal_error = WrapAngle(T_map_goal_.angle - T_map_base.angle);
    const PlaneVelocity arc = Toward(carrot, sideways ? goal_error : bearing);
    if (!options_.omnidirectional && std::abs(bearing) > M_PI_2) continue;
    const double look = std::max(carrot.norm(), options_.lookahead * share);
    const double free = surroundings.FreeLength(arc, look);
    double speed = std::min(arc.Speed(), SpeedBefore(remaining));
    speed = std::max(speed, std::min(kSlowest, arc.Speed()));
    if (free < look) speed = std::min(speed, SpeedBefore(free));
    if (speed <= best_speed) continue;
    best_speed = speed;
    const double scale = speed / arc.Speed();
    best = {arc.x * scale, arc.y * scale, arc.yaw * scale};
    if (free >= look) break;
  }
  if (best_speed < 0.5 * kSlowest) return {ControlState::kBlocked, {}};
  const double near = std::max(0.0, surroundings.Clearance() / options_.slow_clearance);
  const double limit = std::max(0.3, std::min(1.0, near)) * options_.max_speed;
  const double allowed = std::min({best_speed, limit, velocity.Speed() + options_.acceleration * period});
  const double scale = allowed / best_speed;
  const double yaw = Approach(velocity.yaw, best.yaw * scale, options_.turn_acceleration * period);
  return {ControlState::kDriving, {best.x * scale, best.y * scale, yaw}};
}

Control LocalController::Step(const Rigid2& T_map_base, const Surroundings& surroundings, const PlaneVelocity& velocity,
                              double period) {
  if (path_.empty()) return {};
  if (IsAtGoal(T_map_base)) {
    const double error = WrapAngle(T_map_goal_.angle - T_map_base.angle);
    if (std::abs(error) <= options_.goal_heading_tolerance) return {ControlState::kArrived, {}};
    return TurnTo(error, velocity, period);
  }
  if (!options_.omnidirectional) {
    const Eigen::Vector2d carrot = T_map_base.Inverse() * CarrotAt(T_map_base.translation, 0.7 * options_.lookahead);
    const double bearing = std::atan2(carrot.y(), carrot.x());
    turning_ = std::abs(bearing) > (turning_ ? kAligned : options_.turn_first);
    if (turning_) return TurnTo(bearing, velocity, period);
  }
  return Drive(T_map_base, surroundings, velocity, period);
}

}  // namespace planar_vslam
