#include "planar_vslam/sim/floor.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

constexpr double kWheel = 0.15;  // m from the base's axis

}  // namespace

Floor::Floor(const World& world) {
  for (Prism& solid : MakeSolids(world.objects)) {
    if (solid.is_floor) raised_.push_back(std::move(solid));
  }
}

double Floor::Height(const Eigen::Vector2d& at) const {
  double height = 0.0;
  for (const Prism& solid : raised_) {
    if (Distance(at, solid.footprint) == 0.0) height = std::max(height, solid.TopAt(at));
  }
  return height;
}

Rigid3 Floor::Stand(const Rigid2& T_world_base) const {
  if (raised_.empty()) return Embed3(T_world_base);
  const auto height = [&](double x, double y) { return Height(T_world_base * Eigen::Vector2d(x, y)); };
  const double ahead = height(kWheel, 0), behind = height(-kWheel, 0), left = height(0, kWheel),
               right = height(0, -kWheel);
  const double pitch = std::atan2(behind - ahead, 2.0 * kWheel), roll = std::atan2(left - right, 2.0 * kWheel);
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()));
  const Rigid3 T_raise(tilt, Eigen::Vector3d(0.0, 0.0, 0.25 * (ahead + behind + left + right)));
  return Embed3(T_world_base) * T_raise;
}

}  // namespace planar_vslam
