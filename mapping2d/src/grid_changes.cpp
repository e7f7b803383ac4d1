#include <algorithm>

#include "planar_vslam/mapping2d/grid.h"

namespace planar_vslam {

bool HaveSameLayout(const OccupancyGrid2d& a, const OccupancyGrid2d& b) {
  return a.width == b.width && a.height == b.height && a.resolution == b.resolution && a.origin == b.origin;
}

std::optional<GridRegion> ChangedRegion(const OccupancyGrid2d& before, const OccupancyGrid2d& after) {
  PV_CHECK(HaveSameLayout(before, after), "width=" << before.width << " and " << after.width);
  int left = after.width, right = -1, bottom = after.height, top = -1;
  for (int y = 0; y < after.height; ++y) {
    for (int x = 0; x < after.width; ++x) {
      if (before.At(x, y) == after.At(x, y)) continue;
      left = std::min(left, x);
      right = std::max(right, x);
      bottom = std::min(bottom, y);
      top = std::max(top, y);
    }
  }
  if (right < 0) return std::nullopt;
  return GridRegion{left, bottom, right - left + 1, top - bottom + 1};
}

}  // namespace planar_vslam
