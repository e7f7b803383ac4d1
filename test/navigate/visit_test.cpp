// Short stays at goals that people walk over.
#include "planar_vslam/navigate/visit.h"

#include <gtest/gtest.h>

#include <cmath>

#include "plane.h"

namespace planar_vslam::test {
namespace {

const Rigid2 kGoal(4.0, 2.0, M_PI_2);

Costmap Hall() {
  Costmap costmap{NavigateOptions()};
  costmap.SetMap(Room(8.0, 8.0));
  return costmap;
}

Foresight Of(const Walker& walker, double now = 0.0) {
  Foresight foresight;
  std::vector<Eigen::Vector2d> way;
  for (double time = 0.0; time <= Visit::kForesight; time += Foresight::kPeriod) way.push_back(walker.At(now + time));
  foresight.people.push_back(way);
  return foresight;
}

TEST(Visit, WaitsBesideTheWayAndEndsAtTheGoal) {
  const NavigateOptions options;
  const Walker walker{{4.0, 1.0}, {4.0, 6.0}, 0.5, 0.0};
  const auto visit = FindVisit(kGoal, Of(walker), options, Hall(), Rigid2(1.0, 2.0, 0.0), 0.05);
  ASSERT_TRUE(visit.has_value());
  EXPECT_GT(std::abs(visit->T_map_wait.translation.x() - 4.0), 0.64);
  EXPECT_LT((visit->T_map_there.translation - kGoal.translation).norm(), options.goal_tolerance);
  EXPECT_EQ(visit->T_map_there.angle, kGoal.angle);
}

TEST(Visit, NoneWhereSomebodyComesTooSoonAgain) {
  const Walker walker{{4.0, 1.2}, {4.0, 3.2}, 1.0, 0.0};
  EXPECT_FALSE(FindVisit(kGoal, Of(walker), NavigateOptions(), Hall(), Rigid2(1.0, 2.0, 0.0), 0.05).has_value());
}

TEST(Visit, NobodyTouchesARobotThatGoesInWhereTheGapIsWide) {
  const NavigateOptions options;
  const Costmap costmap = Hall();
  const Walker walker{{4.0, 1.0}, {4.0, 6.0}, 0.5, 0.0};
  const auto visit = FindVisit(kGoal, Of(walker), options, costmap, Rigid2(1.0, 2.0, 0.0), 0.05);
  ASSERT_TRUE(visit.has_value());
  int tried = 0;
  for (double start = 0.0; start < 20.0; start += 0.5) {
    const double gap = GapOfVisit(*visit, Of(walker, start), options, costmap, visit->T_map_wait, {}, 0.0);
    if (gap < 0.05) continue;
    ++tried;
    Rigid2 T_map_base = visit->T_map_wait;
    VisitStep step;
    double time = 0.0, stayed = 0.0, least = 1e9;
    for (; stayed < Visit::kStay && time < 20.0; time += 0.1) {
      step = StepVisit(*visit, options, T_map_base, step.velocity, 0.1);
      if (step.there) stayed += 0.1;
      T_map_base = T_map_base * ExpSe2(0.1 * Eigen::Vector3d(step.velocity.x, 0.0, step.velocity.yaw));
      least = std::min(least, (walker.At(start + time) - T_map_base.translation).norm() - 0.55);
    }
    EXPECT_LT((T_map_base.translation - kGoal.translation).norm(), options.goal_tolerance);
    EXPECT_LT(std::abs(WrapAngle(T_map_base.angle - kGoal.angle)), options.goal_heading_tolerance);
    EXPECT_GT(least, 0.0) << start;
  }
  EXPECT_GT(tried, 0);
}

TEST(Visit, WhoIsAboutToComeLeavesNoGapOut) {
  const NavigateOptions options;
  const Walker walker{{4.0, 1.0}, {4.0, 6.0}, 0.5, 0.0};
  const auto gaps = GapsOut(kGoal, Of(walker), options, Hall());
  ASSERT_FALSE(gaps.empty());
  EXPECT_LT(gaps[4], 0.0);   // 1 s: the walker is half a metre away
  EXPECT_GT(gaps[20], 0.1);  // 5 s: past the goal, and away for long
  EXPECT_TRUE(GapsOut(Rigid2(1.0, 2.0, 0.0), Of(walker), options, Hall()).empty());
}

}  // namespace
}  // namespace planar_vslam::test
