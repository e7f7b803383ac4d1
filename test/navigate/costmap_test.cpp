// Costmap and planner on small grids.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "plane.h"

namespace planar_vslam::test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// One beam straight ahead.
PlanarScan Beam(float range) {
  PlanarScan scan;
  scan.range_max = 5.0;
  scan.ranges = {range};
  return scan;
}

TEST(Costmap, ClearanceIsTheDistanceLessTheBody) {
  Costmap costmap{NavigateOptions()};
  ASSERT_TRUE(costmap.SetMap(Room(4.0, 4.0)));
  EXPECT_NEAR(costmap.Clearance({0.6, 2.0}), 0.55 - 0.3, 0.051);
  EXPECT_LT(costmap.Clearance({0.2, 2.0}), 0.0);
  EXPECT_EQ(costmap.CostOfCell(costmap.CellOf({2.0, 2.0}), Layers::kMapAndLaser), 0.0);
  EXPECT_GT(costmap.CostOfCell(costmap.CellOf({0.4, 2.0}), Layers::kMapAndLaser), 0.5);
  EXPECT_EQ(costmap.Clearance({-1.0, 2.0}), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(costmap.KindAt({kNan, 2.0}), CellKind::kOutside);
}

TEST(Costmap, TheLaserMarksAndClears) {
  Costmap costmap{NavigateOptions()};
  ASSERT_TRUE(costmap.SetMap(Room(4.0, 4.0)));
  const Rigid2 laser(1.0, 2.0, 0.0);
  costmap.AddSweep(0.0, laser, Beam(1.5F));
  EXPECT_EQ(costmap.KindAt({2.5, 2.0}), CellKind::kOccupied);
  EXPECT_LT(costmap.Clearance({2.3, 2.0}), 0.0);
  EXPECT_GT(costmap.Clearance({2.3, 2.0}, Layers::kMapOnly), 0.3);
  costmap.AddSweep(0.1, laser, Beam(2.2F));
  EXPECT_NE(costmap.KindAt({2.5, 2.0}), CellKind::kOccupied);
  EXPECT_EQ(costmap.marks(), 1U);
  costmap.ClearMarks();
  EXPECT_EQ(costmap.marks(), 0U);
  EXPECT_GT(costmap.Clearance({2.3, 2.0}), 0.3);
}

TEST(Costmap, AMarkOutOfSightIsForgotten) {
  NavigateOptions options;
  Costmap costmap{options};
  ASSERT_TRUE(costmap.SetMap(Room(4.0, 4.0)));
  costmap.AddSweep(0.0, Rigid2(1.0, 2.0, 0.0), Beam(1.5F));
  costmap.AddSweep(0.5 * options.mark_lifetime, Rigid2(1.0, 2.0, M_PI_2), Beam(1.0F));
  EXPECT_EQ(costmap.marks(), 2U);
  costmap.AddSweep(1.2 * options.mark_lifetime, Rigid2(1.0, 2.0, M_PI_2), Beam(1.0F));
  EXPECT_EQ(costmap.marks(), 1U);
}

TEST(Costmap, RefusesMapsAndPartsThatDoNotFit) {
  Costmap costmap{NavigateOptions()};
  OccupancyGrid2d bad = Room(2.0, 2.0);
  bad.cells.pop_back();
  EXPECT_FALSE(costmap.SetMap(bad));
  bad = Room(2.0, 2.0);
  bad.resolution = kNan;
  EXPECT_FALSE(costmap.SetMap(bad));
  EXPECT_FALSE(costmap.SetMap({}));
  ASSERT_TRUE(costmap.SetMap(Room(2.0, 2.0)));
  EXPECT_TRUE(costmap.UpdateMap({20, 20, 1, 2}, {100, 100}));
  EXPECT_EQ(costmap.KindAt({1.01, 1.06}), CellKind::kOccupied);
  EXPECT_FALSE(costmap.UpdateMap({39, 20, 2, 1}, {0, 0}));
  EXPECT_FALSE(costmap.UpdateMap({-1, 20, 1, 1}, {0}));
  EXPECT_FALSE(costmap.UpdateMap({1, 1, 2, 2}, {0}));
  EXPECT_FALSE(costmap.UpdateMap({1, 1, std::numeric_limits<int>::max(), 1}, {0}));
}

TEST(Costmap, AnUpdatedPartIsAsTheWholeMapMadeAnew) {
  constexpr std::array<std::int8_t, 4> kKinds = {0, 0, -1, 100};
  std::mt19937_64 generator(3);
  const auto draw = [&](int from, int to) { return std::uniform_int_distribution<int>(from, to)(generator); };
  for (const double unknown_margin : {0.1, 0.3, 0.6}) {
    NavigateOptions options;
    options.unknown_margin = unknown_margin;
    OccupancyGrid2d grid = Room(5.0, 3.0);
    Costmap updated{options};
    ASSERT_TRUE(updated.SetMap(grid));
    for (int round = 0; round < 40; ++round) {
      GridRegion part;
      part.x = draw(0, grid.width - 1), part.y = draw(0, grid.height - 1);
      part.width = draw(1, std::min(12, grid.width - part.x));
      part.height = draw(1, std::min(12, grid.height - part.y));
      std::vector<std::int8_t> cells;
      for (int i = 0; i < part.width * part.height; ++i) cells.push_back(kKinds[static_cast<std::size_t>(draw(0, 3))]);
      ASSERT_TRUE(updated.UpdateMap(part, cells));
      Costmap anew{options};
      ASSERT_TRUE(anew.SetMap(updated.map()));
      for (int cell = 0; cell < grid.width * grid.height; ++cell)
        ASSERT_EQ(updated.ClearanceOfCell(cell, Layers::kMapOnly), anew.ClearanceOfCell(cell, Layers::kMapOnly));
    }
  }
}

TEST(GlobalPlanner, GoesThroughADoorInTheMiddle) {
  OccupancyGrid2d grid = Room(8.0, 4.0);
  Fill(&grid, 3.9, 0.0, 4.1, 1.5);
  Fill(&grid, 3.9, 2.5, 4.1, 4.0);
  const NavigateOptions options;
  Costmap costmap{options};
  ASSERT_TRUE(costmap.SetMap(grid));
  const Plan plan = PlanPath(costmap, options, {1.0, 1.0}, {7.0, 3.0});
  ASSERT_TRUE(plan.found()) << plan.reason;
  EXPECT_EQ(plan.path.back(), Eigen::Vector2d(7.0, 3.0));
  for (const Eigen::Vector2d& p : plan.path) {
    EXPECT_GE(costmap.Clearance(p), 0.0);
    if (std::abs(p.x() - 4.0) < 0.05) {
      EXPECT_NEAR(p.y(), 2.0, 0.1);
    }
  }
}

TEST(GlobalPlanner, SaysWhyThereIsNoWay) {
  OccupancyGrid2d grid = Room(8.0, 4.0);
  Fill(&grid, 3.9, 0.0, 4.1, 4.0);
  Fill(&grid, 6.5, 2.5, 8.0, 4.0, -1);
  Fill(&grid, 1.0, 3.0, 1.5, 3.5);
  NavigateOptions options;
  Costmap costmap{options};
  const Eigen::Vector2d start(1.0, 1.0);
  EXPECT_EQ(PlanPath(costmap, options, start, start).status, PlanStatus::kNoMap);
  ASSERT_TRUE(costmap.SetMap(grid));
  const auto status = [&](double x, double y) {
    const Plan plan = PlanPath(costmap, options, start, {x, y});
    EXPECT_EQ(plan.found(), plan.reason.empty());
    return plan.status;
  };
  EXPECT_EQ(status(3.0, 1.0), PlanStatus::kFound);
  EXPECT_EQ(status(1.0, 1.0), PlanStatus::kFound);
  EXPECT_EQ(status(kNan, 1.0), PlanStatus::kNotFinite);
  EXPECT_EQ(status(-3.0, 1.0), PlanStatus::kOutsideMap);
  EXPECT_EQ(status(1e300, 1.0), PlanStatus::kOutsideMap);
  EXPECT_EQ(status(1.2, 3.2), PlanStatus::kInObstacle);
  EXPECT_EQ(status(7.0, 3.2), PlanStatus::kInUnknown);
  EXPECT_EQ(status(3.75, 1.0), PlanStatus::kTooNarrow);
  EXPECT_EQ(status(6.3, 3.2), PlanStatus::kTooNarrow);  // the body would reach into unknown space
  EXPECT_EQ(status(6.0, 1.0), PlanStatus::kNoWay);
  EXPECT_EQ(PlanPath(costmap, options, {-5.0, 0.0}, {3.0, 1.0}).status, PlanStatus::kStartBlocked);
}

TEST(NavigateOptions, CheckThemselves) {
  EXPECT_TRUE(NavigateOptions().Problems().empty());
  NavigateOptions options;
  options.robot_radius = kNan;
  options.max_speed = 0.0;
  EXPECT_EQ(options.Problems().size(), 2U);
  options = NavigateOptions();
  options.inflation_radius = 0.1;
  EXPECT_EQ(options.Problems().size(), 1U);
}

}  // namespace
}  // namespace planar_vslam::test
