#include "planar_vslam/navigate/surroundings.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

constexpr double kStep = 0.02;     // m between two places of the body that are checked
constexpr double kBeside = 0.001;  // m: standing beside something is not coming closer

}  // namespace

std::vector<Eigen::Vector2d> PointsOf(const PlanarScan& scan, const Rigid2& T_base_laser) {
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double range = static_cast<double>(scan.ranges[i]);
    if (!(range >= scan.range_min && range < scan.range_max)) continue;
    const double angle = scan.angle_min + static_cast<double>(i) * scan.angle_increment;
    points.push_back(T_base_laser * Eigen::Vector2d(range * std::cos(angle), range * std::sin(angle)));
  }
  return points;
}

Surroundings::Surroundings(const Costmap& costmap, const NavigateOptions& options, const Rigid2& T_map_base,
                           std::vector<Eigen::Vector2d> points)
    : costmap_(costmap), options_(options), T_map_base_(T_map_base), points_(std::move(points)) {}

double Surroundings::LaserClearance(const Eigen::Vector2d& p_base) const {
  double nearest = options_.mark_range * options_.mark_range;
  for (const Eigen::Vector2d& point : points_) nearest = std::min(nearest, (point - p_base).squaredNorm());
  return std::sqrt(nearest) - options_.robot_radius;
}

double Surroundings::ClearanceAt(const Eigen::Vector2d& p_base) const {
  return std::min(costmap_.Clearance(T_map_base_ * p_base), LaserClearance(p_base));
}

double Surroundings::FreeLength(const PlaneVelocity& velocity, double length) const {
  const double speed = velocity.Speed();
  if (speed <= 0.0) return length;
  // A costmap's clearance is rounded to cells; the sweep's is not.
  const double map_needed = std::min(options_.safety_margin, costmap_.Clearance(T_map_base_.translation) - kBeside);
  const double laser_needed = std::min(options_.safety_margin, LaserClearance(Eigen::Vector2d::Zero()) - kBeside);
  const Eigen::Vector3d twist(velocity.x, velocity.y, velocity.yaw);
  const int steps = static_cast<int>(std::ceil(length / kStep));
  for (int i = 1; i <= steps; ++i) {
    const double s = std::min(length, i * kStep);
    const Rigid2 T_base_then = ExpSe2(twist * (s / speed));
    if (costmap_.Clearance(T_map_base_ * T_base_then.translation) < map_needed) return s - kStep;
    if (LaserClearance(T_base_then.translation) < laser_needed) return s - kStep;
  }
  return length;
}

}  // namespace planar_vslam
