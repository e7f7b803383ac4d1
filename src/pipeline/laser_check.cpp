#include "planar_vslam/pipeline/laser_check.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

constexpr double kApart = 0.3;                       // s between the sweeps that are compared
constexpr long kEnough = 400;                        // comparisons that tell
constexpr double kLeastTurn = 0.1, kMostTurn = 0.7;  // rad between two of them
constexpr std::size_t kMostWaiting = 20;             // sweeps that odometry does not cover

// Mean difference of the ranges of two sweeps, the second shifted by so many beams against the first; cut at a metre
// each, since what is behind an edge differs by any amount. Of every `every`-th beam. Nothing where they hardly
// overlap.
std::optional<double> ShiftedDifference(const PlanarScan& first, const PlanarScan& second, long shift,
                                        std::size_t every) {
  double sum = 0.0, count = 0.0;
  for (std::size_t i = 0; i < second.ranges.size(); i += every) {
    const long k = static_cast<long>(i) + shift;
    if (k < 0 || k >= static_cast<long>(first.ranges.size())) continue;
    const double difference =
        std::abs(static_cast<double>(first.ranges[static_cast<std::size_t>(k)] - second.ranges[i]));
    if (!std::isfinite(difference)) continue;
    sum += std::min(difference, 1.0);
    count += 1.0;
  }
  constexpr double kOverlap = 0.25;
  if (count * static_cast<double>(every) < kOverlap * static_cast<double>(second.ranges.size())) return std::nullopt;
  return sum / count;
}

// The same for a turn about the laser's axis.
std::optional<double> Difference(const PlanarScan& first, const PlanarScan& second, double turn) {
  if (first.angle_increment == 0.0) return std::nullopt;
  return ShiftedDifference(first, second, std::lround(turn / first.angle_increment), 1);
}

// The turn about the laser's axis under which two sweeps are most alike, between beams by a parabola.
std::optional<double> TurnOf(const PlanarScan& first, const PlanarScan& second) {
  constexpr std::size_t kBeams = 180;  // that are looked at
  if (first.angle_increment == 0.0) return std::nullopt;
  const double beams = std::min(kMostTurn / std::abs(first.angle_increment), static_cast<double>(first.ranges.size()));
  const auto widest = static_cast<long>(beams);
  const std::size_t every = 1 + second.ranges.size() / kBeams;
  std::vector<double> differences;
  for (long shift = -widest; shift <= widest; ++shift) {
    const std::optional<double> difference = ShiftedDifference(first, second, shift, every);
    if (!difference.has_value()) return std::nullopt;
    differences.push_back(*difference);
  }
  const auto best = std::min_element(differences.begin(), differences.end()) - differences.begin();
  if (best == 0 || best + 1 == static_cast<std::ptrdiff_t>(differences.size())) return std::nullopt;
  const double here = differences[static_cast<std::size_t>(best)];
  const double before = differences[static_cast<std::size_t>(best - 1)] - here;
  const double after = differences[static_cast<std::size_t>(best + 1)] - here;
  const double between = before + after > 0.0 ? 0.5 * (before - after) / (before + after) : 0.0;
  return (static_cast<double>(best - widest) + between) * first.angle_increment;
}

}  // namespace

void LaserCheck::Add(const LaserFrame& frame) {
  if ((agree_ + mirrored_ >= kEnough && direction_.IsDone()) || sweeps_.size() > kMostWaiting) return;
  if (!sweeps_.empty() && SecondsBetween(sweeps_.back().scan.stamp, frame.scan.stamp) < kApart) return;
  sweeps_.push_back(frame);
}

void LaserCheck::Add(const OdometryReading& reading) {
  odometry_.Push(reading);
  if (odometry_.empty()) return;
  while (sweeps_.size() > 1 && sweeps_[1].scan.stamp <= odometry_.last_stamp()) {
    AddTurn(sweeps_[0], sweeps_[1]);
    Compare(sweeps_[0], sweeps_[1]);
    sweeps_.pop_front();
  }
  if (!sweeps_.empty() && sweeps_.front().scan.stamp <= odometry_.last_stamp()) {
    odometry_.DropBefore(sweeps_.front().scan.stamp);
  } else if (sweeps_.empty()) {
    odometry_.DropBefore(odometry_.last_stamp());
  }
}

void LaserCheck::AddTurn(const LaserFrame& first, const LaserFrame& second) {
  constexpr std::size_t kMost = 1500;
  if (turns_.size() >= kMost) return;
  const std::optional<double> turn = TurnOf(first.scan, second.scan);
  if (!turn.has_value()) return;
  const bool hangs = second.T_base_laser.R()(2, 2) < 0.0;  // its axis points down
  turns_.push_back({first.scan.stamp, second.scan.stamp, hangs ? -*turn : *turn});
}

void LaserCheck::Compare(const LaserFrame& first, const LaserFrame& second) {
  constexpr double kClear = 0.8;  // of the other difference
  const std::optional<Rigid2> T_odom_first = odometry_.Interpolate(first.scan.stamp);
  const std::optional<Rigid2> T_odom_second = odometry_.Interpolate(second.scan.stamp);
  if (!T_odom_first.has_value() || !T_odom_second.has_value()) return;
  CompareWay(second, *T_odom_second);
  const double turn = WrapAngle(T_odom_second->angle - T_odom_first->angle);
  if (std::abs(turn) < kLeastTurn || std::abs(turn) > kMostTurn) return;
  // About the laser's own axis, which points down where it hangs.
  const double own = second.T_base_laser.R()(2, 2) < 0.0 ? -turn : turn;
  const std::optional<double> as_said = Difference(first.scan, second.scan, own);
  const std::optional<double> mirrored = Difference(first.scan, second.scan, -own);
  if (!as_said.has_value() || !mirrored.has_value()) return;
  agree_ += *as_said < kClear * *mirrored ? 1 : 0;
  mirrored_ += *mirrored < kClear * *as_said ? 1 : 0;
}

// With the last sweep from which the robot has driven far enough, but not turned too far.
void LaserCheck::CompareWay(const LaserFrame& frame, const Rigid2& T_odom_base) {
  constexpr double kFar = 0.4, kTurned = 0.4;  // m, rad
  if (way_start_.has_value()) {
    const Rigid2 driven = way_start_->second.Inverse() * T_odom_base;
    if (driven.translation.norm() < kFar && std::abs(driven.angle) < kTurned) return;
    direction_.Add(way_start_->first, frame, driven);
  }
  way_start_.emplace(frame, T_odom_base);
}

std::optional<double> LaserCheck::Turned() const {
  if (IsUpsideDown() || !way_start_.has_value()) return std::nullopt;
  const std::optional<double> turned = direction_.Turned();
  const bool hangs = way_start_->first.T_base_laser.R()(2, 2) < 0.0;  // so its axis points down
  return turned.has_value() && hangs ? std::optional<double>(WrapAngle(-*turned)) : turned;
}

bool LaserCheck::IsUpsideDown() const {
  constexpr long kFewest = 5, kTimes = 3;
  return mirrored_ >= kFewest && mirrored_ > kTimes * agree_;
}

}  // namespace planar_vslam
