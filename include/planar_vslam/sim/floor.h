#pragma once
// What the robot stands on: the room's floor with ramps and sills on it.
#include <vector>

#include "planar_vslam/geometry/rigid3.h"
#include "planar_vslam/sim/solids.h"

namespace planar_vslam {

class Floor {
 public:
  Floor() = default;  // flat
  explicit Floor(const World& world);

  double Height(const Eigen::Vector2d& at) const;  // m
  // T_world_base of a robot that would be at T_world_base on a flat floor: its wheels, four of them 0.15 m ahead,
  // behind, left and right, follow the floor.
  Rigid3 Stand(const Rigid2& T_world_base) const;

 private:
  std::vector<Prism> raised_;
};

}  // namespace planar_vslam
