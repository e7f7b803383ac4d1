#pragma once
// Where cameras looked through.
#include <Eigen/Core>
#include <vector>

#include "planar_vslam/mapping2d/overhang.h"

namespace planar_vslam {

// A camera at `from` saw a point at `to`: nothing is in between. m.
struct SightLine {
  Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = Eigen::Vector3d::Zero();
};

// How many lines pass through a level face of that outline and height, at least `inset` m within its rim. Those that
// end less than `clearance` m above or below it may end on it.
int LinesThrough(const std::vector<SightLine>& lines, const Overhang& outline, double height, double inset,
                 double clearance);

}  // namespace planar_vslam
