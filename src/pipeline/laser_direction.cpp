#include "planar_vslam/pipeline/laser_direction.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

// Mean difference between the ranges of the first sweep and those that the second one's points would have there; cut at
// a metre each, since what is behind an edge differs by any amount. Nothing where they hardly overlap.
std::optional<double> Difference(const PlanarScan& first, const PlanarScan& second, const Rigid3& T_first_second) {
  constexpr std::size_t kBeams = 120;  // of the second sweep, that are looked at
  constexpr double kFarthest = 1.0;    // m
  const std::size_t every = 1 + second.ranges.size() / kBeams;
  double sum = 0.0, count = 0.0, beams = 0.0;
  for (std::size_t i = 0; i < second.ranges.size(); i += every) {
    beams += 1.0;
    const double range = static_cast<double>(second.ranges[i]);
    if (!std::isfinite(range) || range >= second.range_max) continue;
    const double angle = second.angle_min + static_cast<double>(i) * second.angle_increment;
    const Eigen::Vector3d p_first =
        T_first_second * Eigen::Vector3d(range * std::cos(angle), range * std::sin(angle), 0.0);
    const double from_start = std::atan2(p_first.y(), p_first.x()) - first.angle_min;
    // Whole turns added so that it lies in the sweep, whichever way that runs.
    const double turn = std::copysign(2.0 * M_PI, first.angle_increment);
    const double along = from_start - turn * std::floor(from_start / turn);
    const auto k = static_cast<std::size_t>(std::lround(along / first.angle_increment));
    if (k >= first.ranges.size()) continue;
    const double there = static_cast<double>(first.ranges[k]);
    if (!std::isfinite(there) || there >= first.range_max) continue;
    sum += std::min(kFarthest, std::abs(p_first.head<2>().norm() - there));
    count += 1.0;
  }
  constexpr double kOverlap = 0.25;
  if (count < kOverlap * beams) return std::nullopt;
  return sum / count;
}

double AngleOf(std::size_t direction, std::size_t directions) {
  return WrapAngle(2.0 * M_PI * static_cast<double>(direction) / static_cast<double>(directions));
}

}  // namespace

void LaserDirection::Add(const LaserFrame& first, const LaserFrame& second, const Rigid2& T_first_second) {
  constexpr double kShortest = 0.3, kLongest = 1.0, kMostTurn = 0.5;  // m, rad
  const double way = T_first_second.translation.norm();
  if (IsDone() || way < kShortest || way > kLongest || std::abs(T_first_second.angle) > kMostTurn) return;
  if (first.scan.angle_increment == 0.0) return;
  std::array<double, kDirections> differences{};
  for (std::size_t i = 0; i < kDirections; ++i) {
    const Rigid3 turned(Eigen::Quaterniond(Eigen::AngleAxisd(AngleOf(i, kDirections), Eigen::Vector3d::UnitZ())),
                        Eigen::Vector3d::Zero());
    const Rigid3 T_laser_laser =
        (first.T_base_laser * turned).Inverse() * Embed3(T_first_second) * (second.T_base_laser * turned);
    const std::optional<double> difference = Difference(first.scan, second.scan, T_laser_laser);
    if (!difference.has_value()) return;
    differences[i] = *difference;
  }
  for (std::size_t i = 0; i < kDirections; ++i) differences_[i] += differences[i];
  ++pairs_;
}

std::optional<double> LaserDirection::Turned() const {
  constexpr int kFewest = 5;        // pairs
  constexpr double kClearly = 0.5;  // of the difference as it should look
  if (pairs_ < kFewest) return std::nullopt;
  const auto best = std::min_element(differences_.begin(), differences_.end());
  if (best == differences_.begin() || *best > kClearly * differences_.front()) return std::nullopt;
  return AngleOf(static_cast<std::size_t>(best - differences_.begin()), kDirections);
}

}  // namespace planar_vslam
