#include "planar_vslam/mapping2d/wall_thickness.h"

#include <gtest/gtest.h>

namespace planar_vslam {
namespace {

OccupancyGrid2d Wall(int thickness) {
  OccupancyGrid2d grid{20, 20, 0.05, Eigen::Vector2d::Zero(), std::vector<std::int8_t>(400, 0)};
  for (int y = 5; y < 5 + thickness; ++y) {
    for (int x = 0; x < 20; ++x) grid.cells[static_cast<std::size_t>(20 * y + x)] = 100;
  }
  return grid;
}

TEST(WallThickness, IsThatOfAStraightWall) {
  for (const int thickness : {1, 2, 3}) EXPECT_DOUBLE_EQ(MedianWallThickness(Wall(thickness)), thickness);
}

TEST(WallThickness, IsZeroWhereNothingIsOccupied) { EXPECT_EQ(MedianWallThickness(Wall(0)), 0.0); }

}  // namespace
}  // namespace planar_vslam
