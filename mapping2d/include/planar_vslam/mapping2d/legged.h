#pragma once
// What stands on legs: a low laser sees the legs and passes between them, below a table top or a seat.
#include <Eigen/Core>
#include <string>
#include <vector>

#include "planar_vslam/mapping2d/grid.h"
#include "planar_vslam/mapping2d/overhang.h"
#include "planar_vslam/mapping2d/sight_line.h"

namespace planar_vslam {

struct LeggedOptions {
  bool enabled = true;
  double max_leg = 0.25;     // m, widest extent of a leg in the grid, noise included
  double min_side = 0.25;    // m between two legs of a piece of furniture...
  double max_side = 2.60;    // m
  double min_height = 0.40;  // m: its top lies somewhere from here...
  double max_height = 0.90;  // m: ...to here

  std::vector<std::string> Problems() const;
};

struct LeggedEvidence {
  OccupancyGrid2d laser;                // what the laser saw
  std::vector<Eigen::Vector2d> path;    // where the robot was, m
  std::vector<Eigen::Vector3d> points;  // landmarks, m
  std::vector<SightLine> sight_lines;   // to them
};

// Rectangles with a leg at each corner, which need no point: tops without texture have none. And what reaches from two
// legs back to a wall, where points show a top all over it, most points for their area first, a leg in one of them
// only. Neither where the robot drove, nor where cameras saw through the top. `overhang` says what points and sight
// lines make a face, and what does not.
std::vector<Overhang> FindLegged(const LeggedEvidence& evidence, const LeggedOptions& options,
                                 const OverhangOptions& overhang);

}  // namespace planar_vslam
