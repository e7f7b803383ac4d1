// The closed loop among people who walk to and fro and wait for nobody.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "plane.h"

namespace planar_vslam::test {
namespace {

constexpr double kLane = 4.0;  // m, x of a way across the room

Walker Crossing(double speed) { return {{kLane, 0.6}, {kLane, 4.4}, speed, 0.0}; }

bool AnyWalks(const Plane& plane) {
  for (const Track& track : plane.navigator.people().tracks()) {
    if (track.walks) return true;
  }
  return false;
}

// Lets the robot look for so long without a goal.
void Watch(Plane* plane, double seconds) {
  for (const double end = plane->time + seconds; plane->time < end;) plane->Step();
}

TEST(People, WhoCrossesAheadIsWaitedForBeforeTheLane) {
  for (const double speed : {0.5, 0.75, 1.0}) {
    Plane plane(NavigateOptions(), Room(8.0, 5.0), Room(8.0, 5.0), Rigid2(1.0, 2.5, 0.0));
    plane.people = {Crossing(speed)};
    plane.navigator.SetGoal(Rigid2(7.0, 2.5, 0.0));
    NavigatorOutput output;
    bool waited_beside = true;
    for (int i = 0; i < 1200; ++i) {
      output = plane.Step();
      if (output.state != GoalState::kDriving) break;
      const bool waits = output.text.find("waits") != std::string::npos;
      if (waits && std::abs(plane.T_map_base.translation.x() - kLane) < 0.55) waited_beside = false;
    }
    EXPECT_EQ(output.state, GoalState::kReached) << output.text << speed;
    EXPECT_TRUE(waited_beside) << speed;
    EXPECT_GT(plane.least_gap, 0.0) << speed;
  }
}

TEST(People, WhoComesAlongAWideWayIsPassed) {
  for (const double speed : {0.5, 0.9}) {
    Plane plane(NavigateOptions(), Room(12.0, 3.0), Room(12.0, 3.0), Rigid2(1.0, 1.5, 0.0));
    plane.people = {{{9.0, 1.5}, {0.8, 1.5}, speed, 0.0}};
    const NavigatorOutput output = plane.DriveTo(Rigid2(11.0, 1.5, 0.0), 120.0);
    EXPECT_EQ(output.state, GoalState::kReached) << output.text << speed;
    EXPECT_GT(plane.least_gap, 0.0) << speed;
  }
}

TEST(People, AGoalInALaneIsReachedInBetweenPasses) {
  Plane plane(NavigateOptions(), Room(8.0, 5.0), Room(8.0, 5.0), Rigid2(1.0, 2.5, 0.0));
  plane.people = {{{kLane, 0.6}, {kLane, 4.4}, 0.5, 0.0}};
  const NavigatorOutput output = plane.DriveTo(Rigid2(kLane, 1.0, 0.0), 120.0);
  EXPECT_EQ(output.state, GoalState::kReached) << output.text;
  EXPECT_GT(plane.least_gap, 0.0);
}

TEST(People, AGoalWithoutTimeInBetweenIsGivenUp) {
  NavigateOptions options;
  options.people_patience = 30.0;
  Plane plane(options, Room(8.0, 5.0), Room(8.0, 5.0), Rigid2(1.0, 2.5, 0.0));
  plane.people = {{{kLane, 1.5}, {kLane, 3.5}, 1.0, 0.0}};
  const NavigatorOutput output = plane.DriveTo(Rigid2(kLane, 2.5, M_PI_2), 120.0);
  EXPECT_EQ(output.state, GoalState::kAborted);
  EXPECT_NE(output.text.find("people"), std::string::npos) << output.text;
  EXPECT_GT(plane.least_gap, 0.0);
}

TEST(People, AGoalInALaneIsVisitedAndLeftAgainInTime) {
  Plane plane(NavigateOptions(), Room(8.0, 5.0), Room(8.0, 5.0), Rigid2(1.0, 2.5, 0.0));
  plane.people = {{{kLane, 0.6}, {kLane, 4.4}, 0.6, 0.0}};
  const NavigatorOutput in = plane.DriveTo(Rigid2(kLane + 0.3, 2.0, M_PI), 150.0);
  EXPECT_EQ(in.state, GoalState::kReached) << in.text;
  Watch(&plane, 1.3);  // until it is sent elsewhere
  const NavigatorOutput out = plane.DriveTo(Rigid2(1.0, 2.5, 0.0), 120.0);
  EXPECT_EQ(out.state, GoalState::kReached) << out.text;
  EXPECT_GT(plane.least_gap, 0.0);
}

TEST(People, ARobotInALaneGetsOutOfItAndBehindWhoComes) {
  Plane plane(NavigateOptions(), Room(8.0, 9.0), Room(8.0, 9.0), Rigid2(kLane, 2.0, M_PI_2));
  plane.people = {{{kLane, 8.4}, {kLane, 0.6}, 0.5, 0.0}};
  const NavigatorOutput output = plane.DriveTo(Rigid2(kLane, 7.5, 0.0), 120.0);
  EXPECT_EQ(output.state, GoalState::kReached) << output.text;
  EXPECT_GT(plane.least_gap, 0.0);
}

TEST(People, WhereNobodyWalksForesightChangesNothing) {
  OccupancyGrid2d truth = Room(8.0, 5.0);
  Fill(&truth, 3.5, 1.5, 4.2, 3.2);
  NavigateOptions foreseeing, blind;
  blind.foresight = 0.0;
  Plane a(foreseeing, Room(8.0, 5.0), truth, Rigid2(1.0, 2.4, 0.0));
  Plane b(blind, Room(8.0, 5.0), truth, Rigid2(1.0, 2.4, 0.0));
  for (Plane* plane : {&a, &b}) plane->navigator.SetGoal(Rigid2(7.0, 2.4, 0.0));
  for (int i = 0; i < 400; ++i) {
    const NavigatorOutput of_a = a.Step(), of_b = b.Step();
    ASSERT_EQ(of_a.state, of_b.state);
    ASSERT_EQ(a.T_map_base.translation, b.T_map_base.translation);
  }
}

TEST(People, FurnitureNeverWalks) {
  OccupancyGrid2d truth = Room(8.0, 5.0);
  for (const double x : {2.5, 4.0, 5.5}) Fill(&truth, x, 2.2, x + 0.4, 2.6);
  Fill(&truth, 3.2, 3.7, 3.3, 3.8);
  Fill(&truth, 4.9, 1.1, 5.0, 1.2);
  Plane plane(NavigateOptions(), Room(8.0, 5.0), truth, Rigid2(1.0, 1.0, 0.0));
  for (const Rigid2& goal : {Rigid2(7.0, 4.0, 1.5), Rigid2(1.0, 4.0, -3.0), Rigid2(7.0, 1.0, 0.0)}) {
    plane.navigator.SetGoal(goal);
    for (int i = 0; i < 600 && plane.Step().state == GoalState::kDriving; ++i) ASSERT_FALSE(AnyWalks(plane));
  }
}

TEST(People, APoseThatJumpsMakesNobodyWalk) {
  OccupancyGrid2d truth = Room(8.0, 5.0);
  for (const double x : {2.5, 4.0, 5.5}) Fill(&truth, x, 2.2, x + 0.3, 2.5);
  for (const double error : {0.05, 0.12, 0.18, 0.5}) {
    Plane plane(NavigateOptions(), Room(8.0, 5.0), truth, Rigid2(1.0, 1.0, 0.7));
    Watch(&plane, 5.0);
    for (int i = 0; i < 100; ++i) {
      if (i % 15 == 0) plane.pose_error = Rigid2((i % 2 == 0 ? error : 0.0), 0.0, 0.02 * (i % 2));
      plane.Step();
      ASSERT_FALSE(AnyWalks(plane)) << error;
    }
  }
}

}  // namespace
}  // namespace planar_vslam::test
