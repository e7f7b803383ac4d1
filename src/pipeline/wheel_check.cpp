#include "planar_vslam/pipeline/wheel_check.h"

#include <cmath>
#include <vector>

namespace planar_vslam {
namespace {

constexpr std::size_t kFewestLinks = 10;

struct Motions {
  Rigid2 by_map, by_wheels;
};

std::vector<Motions> MotionsOf(const Map& map) {
  std::vector<Motions> motions;
  for (const auto& [id, keyframe] : map.keyframes) {
    if (!keyframe.odometry_link.has_value() || !map.keyframes.Contains(keyframe.odometry_link->from)) continue;
    const Rigid3& T_map_from = map.keyframes.At(keyframe.odometry_link->from).T_map_base;
    motions.push_back(
        {ProjectToPlane(T_map_from.Inverse() * keyframe.T_map_base), keyframe.odometry_link->motion.T_i_j});
  }
  return motions;
}

// The slope of y over x through the origin.
std::optional<Deviation> Slope(const std::vector<Motions>& motions) {
  constexpr double kLeastTurn = 2.0;  // rad, in all
  double xx = 0.0, xy = 0.0, turned = 0.0, squares = 0.0;
  for (const Motions& m : motions) {
    xx += m.by_map.angle * m.by_map.angle;
    xy += m.by_map.angle * m.by_wheels.angle;
    turned += std::abs(m.by_map.angle);
  }
  if (motions.size() < kFewestLinks || turned < kLeastTurn) return std::nullopt;
  const double slope = xy / xx;
  for (const Motions& m : motions) squares += std::pow(m.by_wheels.angle - slope * m.by_map.angle, 2);
  return Deviation{slope - 1.0, std::sqrt(squares / static_cast<double>(motions.size() - 1) / xx)};
}

// By the chords of nearly straight steps.
std::optional<Deviation> Direction(const std::vector<Motions>& motions) {
  constexpr double kShortest = 0.03, kStraight = 0.35;  // m, rad
  double sine = 0.0, cosine = 0.0, squares = 0.0;
  std::vector<Eigen::Vector2d> turns;  // from the map's chord to the wheels'
  for (const Motions& m : motions) {
    const Eigen::Vector2d &a = m.by_map.translation, &b = m.by_wheels.translation;
    if (b.norm() < kShortest || std::abs(m.by_map.angle) > kStraight) continue;
    turns.emplace_back(a.dot(b), a.x() * b.y() - a.y() * b.x());
    cosine += turns.back().x();
    sine += turns.back().y();
  }
  if (turns.size() < kFewestLinks || turns.size() < motions.size() / 4) return std::nullopt;
  const double mean = std::atan2(sine, cosine);
  for (const Eigen::Vector2d& turn : turns) {
    squares += std::pow(turn.y() * std::cos(mean) - turn.x() * std::sin(mean), 2);
  }
  return Deviation{mean, std::sqrt(squares) / std::hypot(sine, cosine)};
}

}  // namespace

WheelCheck CheckWheels(const Map& map) {
  const std::vector<Motions> motions = MotionsOf(map);
  return {Slope(motions), Direction(motions)};
}

}  // namespace planar_vslam
