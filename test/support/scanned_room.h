#pragma once
// What a laser sees of walls seen from above.
#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "planar_vslam/geometry/rigid2.h"
#include "planar_vslam/geometry/rigid3.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

using Segment = std::pair<Eigen::Vector2d, Eigen::Vector2d>;

inline std::vector<Segment> Closed(const std::vector<Eigen::Vector2d>& corners) {
  std::vector<Segment> walls;
  for (std::size_t i = 0; i < corners.size(); ++i) walls.emplace_back(corners[i], corners[(i + 1) % corners.size()]);
  return walls;
}

// An L-shaped room of 6 x 5 m with a box in it.
inline std::vector<Segment> Room() {
  std::vector<Segment> walls = Closed({{-3, -2}, {3, -2}, {3, 1}, {0.5, 1}, {0.5, 3}, {-3, 3}});
  const std::vector<Segment> box = Closed({{-1.8, 0.9}, {-1.2, 1.1}, {-1.4, 1.7}, {-2.0, 1.5}});
  walls.insert(walls.end(), box.begin(), box.end());
  return walls;
}

// Two walls without ends in sight.
inline std::vector<Segment> Corridor() { return {{{-50, -1}, {50, -1}}, {{-50, 1}, {50, 1}}}; }

inline float RangeTo(const std::vector<Segment>& walls, const Eigen::Vector2d& from, double angle) {
  const Eigen::Vector2d ray(std::cos(angle), std::sin(angle));
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& [a, b] : walls) {
    const Eigen::Vector2d along = b - a, offset = a - from;
    const double cross = ray.x() * along.y() - ray.y() * along.x();
    if (std::abs(cross) < 1e-12) continue;
    const double range = (offset.x() * along.y() - offset.y() * along.x()) / cross;
    const double share = (offset.x() * ray.y() - offset.y() * ray.x()) / cross;
    if (range > 0.0 && share >= 0.0 && share <= 1.0) nearest = std::min(nearest, range);
  }
  return static_cast<float>(nearest);
}

inline const Rigid3 kT_base_laser(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.1, 0.0, 0.25));

inline PlanarScan Sweep(const std::vector<Segment>& walls, const Rigid2& T_world_base, double noise,
                        std::mt19937* generator) {
  PlanarScan scan;
  scan.angle_min = -0.75 * M_PI;
  scan.angle_increment = 1.5 * M_PI / 540.0;
  scan.range_max = 8.0;
  const Rigid2 T_world_laser = T_world_base * Rigid2(0.1, 0.0, 0.0);
  std::normal_distribution<float> deviation(0.0F, 1.0F);
  for (int beam = 0; beam <= 540; ++beam) {
    const double angle = T_world_laser.angle + scan.angle_min + beam * scan.angle_increment;
    const float range = RangeTo(walls, T_world_laser.translation, angle);
    scan.ranges.push_back(range < 8.0F ? range + static_cast<float>(noise) * deviation(*generator)
                                       : std::numeric_limits<float>::infinity());
  }
  return scan;
}

}  // namespace planar_vslam
