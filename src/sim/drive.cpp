#include "planar_vslam/sim/drive.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "planar_vslam/sim/obstacles.h"

namespace planar_vslam {
namespace {

using Eigen::Vector2d;

// A line of straight pieces by arc length.
class Line {
 public:
  explicit Line(std::vector<Vector2d> points) : points_(std::move(points)) {
    for (std::size_t i = 0; i < points_.size(); ++i) {
      lengths_.push_back(i == 0 ? 0.0 : lengths_.back() + (points_[i] - points_[i - 1]).norm());
    }
  }
  double length() const { return lengths_.back(); }
  Vector2d At(double along) const {
    const auto next = std::upper_bound(lengths_.begin(), lengths_.end(), along);
    if (next == lengths_.end()) return points_.back();
    const auto i = static_cast<std::size_t>(next - lengths_.begin());
    const double share = (along - lengths_[i - 1]) / (lengths_[i] - lengths_[i - 1]);
    return points_[i - 1] + share * (points_[i] - points_[i - 1]);
  }

 private:
  std::vector<Vector2d> points_;
  std::vector<double> lengths_;  // from the start to each point
};

// From `from` through the waypoints: once, or round and round for the laps asked for.
std::vector<Vector2d> MakeLine(const DriveSpec& drive, const Vector2d& from) {
  const std::vector<Vector2d>& waypoints = drive.waypoints;
  std::vector<Vector2d> points = {from};
  if (drive.laps == 0.0) {
    points.insert(points.end(), waypoints.begin(), waypoints.end());
    return points;
  }
  double lap = 0.0;
  for (std::size_t i = 0; i < waypoints.size(); ++i)
    lap += (waypoints[(i + 1) % waypoints.size()] - waypoints[i]).norm();
  points.push_back(waypoints[0]);
  double left = drive.laps * lap;
  for (std::size_t i = 1; left > 0.0 && lap > 0.0; ++i) {
    const Vector2d step = waypoints[i % waypoints.size()] - points.back();
    const double length = step.norm();
    points.emplace_back(points.back() + std::min(1.0, length > 0.0 ? left / length : 1.0) * step);
    left -= length;
  }
  return points;
}

// Sideways along a minimum-jerk profile (T. Flash, N. Hogan, J. Neurosci. 1985).
void Shuffle(const DriveSpec& drive, std::vector<Rigid2>* poses) {
  constexpr double kPeakFactor = 1.875;  // peak / mean speed of the profile
  const double duration = kPeakFactor * std::abs(drive.shuffle) / drive.sideways_speed;
  const int steps = static_cast<int>(std::ceil(duration / Drive::kStep));
  for (int i = 1; i <= steps; ++i) {
    const double s = static_cast<double>(i) / steps;
    const double along = drive.shuffle * s * s * s * (10.0 + s * (-15.0 + 6.0 * s));
    poses->push_back(drive.start * Rigid2(0.0, along, 0.0));
  }
}

// Follows a point a little ahead on the line with limited speed, turn rate and accelerations.
class Follower {
 public:
  Follower(const DriveSpec& drive, Line line, const Rigid2& start)
      : drive_(drive), line_(std::move(line)), pose_(start) {}

  // One time step; false once it stands at the end.
  bool Step() {
    AdvanceAlong();
    const double remaining = line_.length() - along_;
    const Vector2d target = pose_.Inverse() * line_.At(along_ + kLookAhead);
    const bool close = remaining + (line_.At(along_) - pose_.translation).norm() < kArrived;
    if (close && speed_ < kStanding && std::abs(turn_rate_) < kStanding) return false;
    const double bearing = close ? 0.0 : std::atan2(target.y(), target.x());
    // Fast when the way lies ahead, in place when it lies behind, slowing down to stop at the end.
    const double ahead = std::max(0.0, 1.0 - std::abs(bearing) / kTurnInPlace);
    const double stopping = std::sqrt(2.0 * kGentle * drive_.acceleration * std::max(0.0, remaining - 0.5 * kArrived));
    Approach(std::min(drive_.speed * ahead, stopping), drive_.acceleration, &speed_);
    const double wanted_turn = std::clamp(kTurnGain * bearing, -drive_.turn_rate, drive_.turn_rate);
    Approach(wanted_turn, drive_.turn_acceleration, &turn_rate_);
    pose_ = pose_ * ExpSe2(Drive::kStep * Eigen::Vector3d(speed_, 0.0, turn_rate_));
    return true;
  }
  const Rigid2& pose() const { return pose_; }
  double along() const { return along_; }
  const Line& line() const { return line_; }

 private:
  static constexpr double kLookAhead = 0.45;                   // m
  static constexpr double kArrived = 0.02;                     // m
  static constexpr double kStanding = 0.005;                   // m/s and rad/s
  static constexpr double kTurnInPlace = 70.0 * M_PI / 180.0;  // rad off the way: turn only
  static constexpr double kTurnGain = 1.8;                     // 1/s
  static constexpr double kGentle = 0.7;                       // share of the deceleration planned for stopping
  static constexpr double kAlongStep = 0.005;                  // m
  static constexpr double kWindow = 0.60;                      // m

  // The nearest place on the line, never backwards and never far ahead: lines may cross themselves. All of the window
  // counts: inside a corner the near leg is a local minimum. The distance changes by no more than the way along the
  // line, so places that cannot be nearer are passed over.
  void AdvanceAlong() {
    constexpr double kRounding = 1e-6;  // m
    const auto distance = [this](double s) { return (line_.At(s) - pose_.translation).squaredNorm(); };
    const double end = std::min(along_ + kWindow, line_.length());
    double nearest = along_, least = distance(along_);
    for (double s = along_ + kAlongStep; s <= end; s += kAlongStep) {
      const double here = distance(s);
      if (here <= least) {
        nearest = s, least = here;
        continue;
      }
      double farther = std::sqrt(here) - std::sqrt(least) - kRounding;
      for (; farther > kAlongStep; farther -= kAlongStep) s += kAlongStep;
    }
    along_ = distance(line_.length()) < least && end == line_.length() ? end : nearest;
  }
  static void Approach(double wanted, double acceleration, double* value) {
    const double step = acceleration * Drive::kStep;
    *value += std::clamp(wanted - *value, -step, step);
  }

  const DriveSpec& drive_;
  Line line_;
  Rigid2 pose_;
  double along_ = 0.0;      // m, progress on the line
  double speed_ = 0.0;      // m/s
  double turn_rate_ = 0.0;  // rad/s
};

// What the robot would touch along the way, if anything.
std::optional<std::string> FindCollision(const World& world, const std::vector<Rigid2>& poses) {
  constexpr std::size_t kEvery = 10;  // poses; 2 cm at 0.4 m/s
  const double radius = world.drive.robot_radius;
  const Obstacles obstacles(world, radius);
  for (std::size_t i = 0; i < poses.size(); i += kEvery) {
    const double time = static_cast<double>(i) * Drive::kStep;
    const std::optional<std::string> touched = obstacles.Touched(poses[i], time);
    if (!touched.has_value()) continue;
    const Vector2d& p = poses[i].translation;
    return fmt::format("the robot of radius {} m touches {} at [{:.2f}, {:.2f}] after {:.1f} s; expected a free way",
                       radius, *touched, p.x(), p.y(), time);
  }
  return std::nullopt;
}

}  // namespace

Rigid2 Drive::At(double time) const {
  const double position = std::clamp(time / kStep, 0.0, static_cast<double>(poses_.size() - 1));
  const auto i = std::min(static_cast<std::size_t>(position), poses_.size() - 1);
  const double share = position - static_cast<double>(i);
  if (share == 0.0 || i + 1 == poses_.size()) return poses_[i];
  return Interpolate(poses_[i], poses_[i + 1], share);
}

DriveSpec Reversed(const DriveSpec& drive) {
  std::vector<Vector2d> points = MakeLine(drive, drive.start * Vector2d(0.0, drive.shuffle));
  if (points.size() < 2) return drive;
  std::reverse(points.begin(), points.end());
  DriveSpec reversed = drive;
  const Vector2d ahead = points[1] - points[0];
  reversed.start = Rigid2(points[0].x(), points[0].y(), std::atan2(ahead.y(), ahead.x()));
  reversed.shuffle = 0.0;
  reversed.laps = 0.0;
  reversed.waypoints.assign(points.begin() + 1, points.end());
  return reversed;
}

Expected<Drive> PlanDrive(const World& world) {
  const DriveSpec& drive = world.drive;
  std::vector<Rigid2> poses = {drive.start};
  Shuffle(drive, &poses);
  if (!drive.waypoints.empty()) {
    Follower follower(drive, Line(MakeLine(drive, poses.back().translation)), poses.back());
    // Several times what the way takes at full speed, plus turning on the spot at every corner.
    const double patience =
        5.0 * follower.line().length() / drive.speed + 30.0 * static_cast<double>(drive.waypoints.size() + 1);
    const std::size_t limit = poses.size() + static_cast<std::size_t>(patience / Drive::kStep);
    while (follower.Step()) {
      poses.push_back(follower.pose());
      if (poses.size() < limit) continue;
      return Error{fmt::format("{}: drive: expected to arrive, but the robot is stuck {:.1f} m along a way of {:.1f} m",
                               world.source, follower.along(), follower.line().length())};
    }
  }
  const std::optional<std::string> collision = FindCollision(world, poses);
  if (collision.has_value()) return Error{fmt::format("{}: drive: {}", world.source, *collision)};
  return Drive(std::move(poses));
}

}  // namespace planar_vslam
