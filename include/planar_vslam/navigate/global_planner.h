#pragma once
// The way to a goal over a costmap: A* over 8-connected cells (Hart, Nilsson and Raphael, 1968), then smoothed.
#include <Eigen/Core>
#include <string>
#include <vector>

#include "planar_vslam/navigate/costmap.h"

namespace planar_vslam {

enum class PlanStatus {
  kFound,
  kNoMap,
  kNotFinite,
  kOutsideMap,
  kInObstacle,
  kInUnknown,
  kTooNarrow,
  kStartBlocked,
  kNoWay
};

struct Plan {
  PlanStatus status = PlanStatus::kNoMap;
  std::string reason;                 // one line; empty where a way was found
  std::vector<Eigen::Vector2d> path;  // map, m, from the start to the goal, about a cell apart
  bool found() const { return status == PlanStatus::kFound; }
};

// A start that is too close to an obstacle is left to the nearest cell where the body fits, at most one radius away.
// `extra` is what each cell of the costmap costs more, in its own lengths; empty: nothing.
Plan PlanPath(const Costmap& costmap, const NavigateOptions& options, const Eigen::Vector2d& start,
              const Eigen::Vector2d& goal, Layers layers = Layers::kMapAndLaser, const std::vector<float>& extra = {});

}  // namespace planar_vslam
