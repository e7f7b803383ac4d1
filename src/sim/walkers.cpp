// Where people are.
#include <algorithm>
#include <cmath>

#include "planar_vslam/sim/scene.h"

namespace planar_vslam {

Walker WalkerAt(const PersonSpec& person, double time) {
  double length = 0.0;
  for (std::size_t i = 1; i < person.path.size(); ++i) length += (person.path[i] - person.path[i - 1]).norm();
  const double walked = person.start + person.speed * std::max(time, 0.0);
  const double turn = std::fmod(walked, 2.0 * length);
  const bool back = turn > length;
  double along = back ? 2.0 * length - turn : turn;
  std::size_t leg = 1;
  while (leg + 1 < person.path.size() && along > (person.path[leg] - person.path[leg - 1]).norm()) {
    along -= (person.path[leg] - person.path[leg - 1]).norm();
    ++leg;
  }
  const Eigen::Vector2d direction = (person.path[leg] - person.path[leg - 1]).normalized();
  const Eigen::Vector2d at = person.path[leg - 1] + along * direction;
  constexpr double kStep = 0.7, kLargestStride = 0.45;  // m
  Walker walker;
  walker.T_world_walker = Rigid2(at, std::atan2(direction.y(), direction.x()) + (back ? M_PI : 0.0));
  walker.stride = kLargestStride * std::sin(M_PI * walked / kStep);
  return walker;
}

}  // namespace planar_vslam
