#pragma once
// How crisp a grid is, without a truth to compare it with.
#include "planar_vslam/mapping2d/grid.h"

namespace planar_vslam {

// Median over the occupied cells, in cells: the shortest of the four straight runs of occupied cells (along x, y and
// both diagonals, a diagonal step counting sqrt 2) through the cell. 0 without occupied cells.
double MedianWallThickness(const OccupancyGrid2d& grid);

}  // namespace planar_vslam
