#include "planar_vslam/mapping2d/wall_thickness.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "planar_vslam/geometry/median.h"

namespace planar_vslam {
namespace {

bool IsOccupied(const OccupancyGrid2d& grid, int x, int y) {
  return x >= 0 && y >= 0 && x < grid.width && y < grid.height && grid.At(x, y) == 100;
}

// Occupied cells from (x, y), not counted, in a straight line.
int Run(const OccupancyGrid2d& grid, int x, int y, int dx, int dy) {
  int length = 0;
  while (IsOccupied(grid, x + (length + 1) * dx, y + (length + 1) * dy)) ++length;
  return length;
}

double Thickness(const OccupancyGrid2d& grid, int x, int y) {
  const auto through = [&](int dx, int dy) {
    return (1 + Run(grid, x, y, dx, dy) + Run(grid, x, y, -dx, -dy)) * std::hypot(dx, dy);
  };
  return std::min({through(1, 0), through(0, 1), through(1, 1), through(1, -1)});
}

}  // namespace

double MedianWallThickness(const OccupancyGrid2d& grid) {
  std::vector<double> thickness;
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      if (IsOccupied(grid, x, y)) thickness.push_back(Thickness(grid, x, y));
    }
  }
  return Median(std::move(thickness));
}

}  // namespace planar_vslam
