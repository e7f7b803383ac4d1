#pragma once
// Places to drive to, drawn at random: for demonstrations and measurements.
#include <cstdint>
#include <vector>

#include "planar_vslam/navigate/costmap.h"

namespace planar_vslam {

struct GoalDrawing {
  int count = 10;
  std::uint64_t seed = 1;
  // Between body and obstacles, m: at a goal, and on a way on which it surely can be reached.
  double clearance = 0.2, way_clearance = 0.1;
};

// Poses in the map that a way connects with `start` (m). Headings are drawn, too. Fewer than `count`, that is none,
// where no cell is free enough; the same map and drawing give the same goals.
std::vector<Rigid2> DrawGoals(const Costmap& costmap, const Eigen::Vector2d& start, const GoalDrawing& drawing);

}  // namespace planar_vslam
