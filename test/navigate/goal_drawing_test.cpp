#include "planar_vslam/navigate/goal_drawing.h"

#include <gtest/gtest.h>

#include "plane.h"

namespace planar_vslam::test {
namespace {

// Two rooms without a door.
Costmap TwoRooms() {
  OccupancyGrid2d grid = Room(8.0, 4.0);
  Fill(&grid, 3.9, 0.0, 4.1, 4.0);
  Costmap costmap{NavigateOptions()};
  costmap.SetMap(grid);
  return costmap;
}

TEST(GoalDrawing, GoalsAreFreeAndConnectedWithTheStart) {
  const Costmap costmap = TwoRooms();
  GoalDrawing drawing;
  drawing.count = 50;
  const std::vector<Rigid2> goals = DrawGoals(costmap, {1.0, 1.0}, drawing);
  ASSERT_EQ(goals.size(), 50U);
  double widest = 0.0;
  for (const Rigid2& goal : goals) {
    EXPECT_LT(goal.translation.x(), 3.9);
    EXPECT_GE(costmap.Clearance(goal.translation), drawing.clearance);
    widest = std::max(widest, (goal.translation - goals[0].translation).norm());
    EXPECT_TRUE(PlanPath(costmap, NavigateOptions(), {1.0, 1.0}, goal.translation).found());
  }
  EXPECT_GT(widest, 1.0);
}

TEST(GoalDrawing, TheSeedDecides) {
  const Costmap costmap = TwoRooms();
  GoalDrawing drawing, other;
  other.seed = 2;
  const auto first = DrawGoals(costmap, {1.0, 1.0}, drawing), again = DrawGoals(costmap, {1.0, 1.0}, drawing);
  EXPECT_EQ(first[3].translation, again[3].translation);
  EXPECT_NE(first[3].translation, DrawGoals(costmap, {1.0, 1.0}, other)[3].translation);
}

TEST(GoalDrawing, NoneWithoutAMapOrWithoutSpace) {
  const Costmap nothing{NavigateOptions()};
  EXPECT_TRUE(DrawGoals(nothing, {1.0, 1.0}, {}).empty());
  Costmap narrow{NavigateOptions()};
  narrow.SetMap(Room(0.9, 4.0));
  EXPECT_TRUE(DrawGoals(narrow, {0.4, 1.0}, {}).empty());
}

}  // namespace
}  // namespace planar_vslam::test
