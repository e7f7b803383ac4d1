#include <gtest/gtest.h>

#include "planar_vslam/mapping2d/grid.h"

namespace planar_vslam {
namespace {

OccupancyGrid2d Empty() { return {6, 4, 0.05, Eigen::Vector2d::Zero(), std::vector<std::int8_t>(24, -1)}; }

TEST(ChangedRegion, IsNothingWhereNothingChanged) { EXPECT_FALSE(ChangedRegion(Empty(), Empty()).has_value()); }

TEST(ChangedRegion, HoldsEveryChangedCellAndNoMore) {
  OccupancyGrid2d after = Empty();
  after.cells[6 * 1 + 4] = 100;
  after.cells[6 * 3 + 2] = 0;
  const auto region = ChangedRegion(Empty(), after);
  ASSERT_TRUE(region.has_value());
  EXPECT_EQ(region->x, 2);
  EXPECT_EQ(region->y, 1);
  EXPECT_EQ(region->width, 3);
  EXPECT_EQ(region->height, 3);
}

TEST(ChangedRegion, LayoutsDifferByOriginSizeAndResolution) {
  EXPECT_TRUE(HaveSameLayout(Empty(), Empty()));
  OccupancyGrid2d moved = Empty(), finer = Empty();
  moved.origin.x() = 0.05;
  finer.resolution = 0.025;
  EXPECT_FALSE(HaveSameLayout(Empty(), moved));
  EXPECT_FALSE(HaveSameLayout(Empty(), finer));
}

}  // namespace
}  // namespace planar_vslam
