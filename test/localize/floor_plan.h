#pragma once
// Rooms of straight walls, and what a laser sees in them.
#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "planar_vslam/localize/likelihood_field.h"

namespace planar_vslam::test {

class FloorPlan {
 public:
  FloorPlan& Wall(double x0, double y0, double x1, double y1) {
    walls_.emplace_back(Eigen::Vector2d(x0, y0), Eigen::Vector2d(x1, y1));
    return *this;
  }
  FloorPlan& Box(double x0, double y0, double x1, double y1) {
    return Wall(x0, y0, x1, y0).Wall(x1, y0, x1, y1).Wall(x1, y1, x0, y1).Wall(x0, y1, x0, y0);
  }
  // The same walls, elsewhere.
  FloorPlan& Add(const FloorPlan& other, const Rigid2& T_this_other) {
    for (const auto& [a, b] : other.walls_) walls_.emplace_back(T_this_other * a, T_this_other * b);
    return *this;
  }

  static Rigid3 T_base_laser() { return Rigid3(Eigen::Matrix3d::Identity(), {0.1, 0.0, 0.25}); }

  PlanarScan Sweep(const Rigid2& T_map_base, unsigned seed = 1, double range_max = 8.0) const {
    constexpr double kSigma = 0.01;  // m
    std::mt19937 generator(seed);
    std::normal_distribution<double> noise(0.0, kSigma);
    PlanarScan scan;
    scan.angle_min = -2.35;
    scan.angle_increment = 4.7 / 360.0;
    scan.range_min = 0.05;
    scan.range_max = range_max;
    const Rigid2 T_map_laser = T_map_base * Rigid2(0.1, 0.0, 0.0);
    for (int i = 0; i <= 360; ++i) {
      const double angle = T_map_laser.angle + scan.angle_min + i * scan.angle_increment;
      const double range = Range(T_map_laser.translation, {std::cos(angle), std::sin(angle)}) + noise(generator);
      scan.ranges.push_back(static_cast<float>(range < range_max ? range : std::numeric_limits<double>::infinity()));
    }
    return scan;
  }
  PosedSweep Posed(const Rigid2& T_map_base, unsigned seed = 1) const {
    return {std::make_shared<const PlanarScan>(Sweep(T_map_base, seed)), T_base_laser(), T_map_base};
  }

 private:
  double Range(const Eigen::Vector2d& from, const Eigen::Vector2d& direction) const {
    double nearest = 1e9;
    for (const auto& [a, b] : walls_) {
      const Eigen::Vector2d along = b - a, off = a - from;
      const double cross = direction.x() * along.y() - direction.y() * along.x();
      if (std::abs(cross) < 1e-12) continue;
      const double range = (off.x() * along.y() - off.y() * along.x()) / cross;
      const double share = (off.x() * direction.y() - off.y() * direction.x()) / cross;
      if (range > 0.0 && share >= 0.0 && share <= 1.0) nearest = std::min(nearest, range);
    }
    return nearest;
  }
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> walls_;
};

// 6 x 4 m with a cupboard and a table's pedestal: no two places look alike.
inline FloorPlan Office() {
  FloorPlan plan;
  plan.Box(0, 0, 6, 4).Box(0, 3, 1.2, 4).Box(3.6, 0.9, 4.3, 1.3).Wall(5.2, 4, 5.2, 3.1);
  return plan;
}
// Another room of about the same size.
inline FloorPlan Workshop() {
  FloorPlan plan;
  plan.Box(0, 0, 5, 5.2).Box(2.2, 2.0, 2.9, 3.6).Box(0, 0, 0.6, 2.0).Wall(5, 3.5, 4, 3.5);
  return plan;
}

// Sweeps from a grid of places in x from..to, y from..to.
inline std::vector<PosedSweep> Mapped(const FloorPlan& plan, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  std::vector<PosedSweep> sweeps;
  unsigned seed = 100;
  for (double x = from.x(); x <= to.x(); x += 0.8) {
    for (double y = from.y(); y <= to.y(); y += 0.8) {
      for (const double heading : {0.0, M_PI}) sweeps.push_back(plan.Posed(Rigid2(x, y, heading), seed++));
    }
  }
  return sweeps;
}
inline std::vector<PosedSweep> MappedOffice() { return Mapped(Office(), {0.6, 0.6}, {5.0, 2.4}); }

}  // namespace planar_vslam::test
