#pragma once
// What stands on legs: a low laser sees the legs and passes between them, below a table top or a seat.
#include <Eigen/Core>
#include <string>
#include <vector>

#include "planar_vslam/geometry/option_fields.h"
#include "planar_vslam/mapping2d/grid.h"
#include "planar_vslam/mapping2d/overhang.h"
#include "planar_vslam/mapping2d/sight_line.h"

namespace planar_vslam {

struct LeggedOptions {
  bool enabled = true;
  double max_leg = 0.25;  // noise included
  double min_side = 0.25;
  double max_side = 2.60;
  double min_height = 0.40;
  double max_height = 0.90;

  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    v("legged_enabled", o.enabled, "furniture between whose legs the laser passes, filled");
    v("legged_max_leg", o.max_leg, unit::kMeters, bound::Positive(), "widest extent of a leg in the grid");
    v("legged_min_side", o.min_side, unit::kMeters, bound::Positive(), "between two legs of a piece of furniture...");
    v("legged_max_side", o.max_side, unit::kMeters, bound::MoreThan("legged_min_side", o.min_side),
      "...at least and at most");
    v("legged_min_height", o.min_height, unit::kMeters, bound::Positive(), "its top lies somewhere from here...");
    v("legged_max_height", o.max_height, unit::kMeters, bound::MoreThan("legged_min_height", o.min_height),
      "...to here");
  }
  std::vector<std::string> Problems() const { return ProblemsOf(*this); }
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
