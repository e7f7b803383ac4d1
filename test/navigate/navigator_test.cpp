// The closed loop in a small plane: doors, blocked ways, bad goals, and a robot that must not move.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "plane.h"

namespace planar_vslam::test {
namespace {

OccupancyGrid2d TwoRooms() {
  OccupancyGrid2d grid = Room(8.0, 5.0);
  Fill(&grid, 3.9, 0.0, 4.1, 2.0);
  Fill(&grid, 3.9, 3.0, 4.1, 5.0);
  return grid;
}

void ExpectAt(const Plane& plane, const Rigid2& goal, const NavigateOptions& options) {
  EXPECT_LE((plane.T_map_base.translation - goal.translation).norm(), options.goal_tolerance);
  EXPECT_LE(std::abs(WrapAngle(plane.T_map_base.angle - goal.angle)), options.goal_heading_tolerance + 0.02);
  EXPECT_GT(plane.least_clearance, 0.0);
}

TEST(Navigator, DrivesThroughADoorToEachGoal) {
  for (const bool omnidirectional : {false, true}) {
    NavigateOptions options;
    options.omnidirectional = omnidirectional;
    Plane plane(options, TwoRooms(), TwoRooms(), Rigid2(1.0, 1.0, 2.0));
    for (const Rigid2& goal : {Rigid2(7.0, 4.0, 1.5), Rigid2(1.0, 4.0, -3.0), Rigid2(6.0, 0.6, 0.0)}) {
      const NavigatorOutput output = plane.DriveTo(goal, 120.0);
      ASSERT_EQ(output.state, GoalState::kReached) << output.text << omnidirectional;
      ExpectAt(plane, goal, options);
    }
  }
}

TEST(Navigator, GoesRoundWhatTheMapDoesNotHave) {
  const NavigateOptions options;
  OccupancyGrid2d truth = Room(8.0, 5.0);
  Fill(&truth, 3.5, 1.5, 4.2, 3.2);
  Plane plane(options, Room(8.0, 5.0), truth, Rigid2(1.0, 2.4, 0.0));
  const NavigatorOutput output = plane.DriveTo(Rigid2(7.0, 2.4, 0.0), 120.0);
  ASSERT_EQ(output.state, GoalState::kReached) << output.text;
  ExpectAt(plane, Rigid2(7.0, 2.4, 0.0), options);
}

TEST(Navigator, GivesUpAtAWayThatStaysBlocked) {
  const NavigateOptions options;
  OccupancyGrid2d truth = TwoRooms();
  Fill(&truth, 3.9, 1.9, 4.1, 3.1);
  Plane plane(options, TwoRooms(), truth, Rigid2(1.0, 1.0, 0.0));
  const NavigatorOutput output = plane.DriveTo(Rigid2(7.0, 4.0, 0.0), 300.0);
  EXPECT_EQ(output.state, GoalState::kAborted);
  EXPECT_NE(output.text.find("recovery did not help"), std::string::npos) << output.text;
  EXPECT_GT(plane.least_clearance, 0.0);
}

TEST(Navigator, AbortsBadGoalsAtOnceAndStands) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  OccupancyGrid2d map = TwoRooms();
  Fill(&map, 3.9, 1.9, 4.1, 3.1);
  Plane plane(NavigateOptions(), map, map, Rigid2(1.0, 1.0, 0.0));
  const Rigid2 start = plane.T_map_base;
  for (const Rigid2& goal : {Rigid2(nan, 0.0, 0.0), Rigid2(1.0, 1.0, nan), Rigid2(-9.0, 1.0, 0.0),
                             Rigid2(4.0, 1.0, 0.0), Rigid2(0.1, 1.0, 0.0), Rigid2(7.0, 1.0, 0.0)}) {
    const NavigatorOutput output = plane.DriveTo(goal, 5.0);
    EXPECT_EQ(output.state, GoalState::kAborted);
    EXPECT_FALSE(output.text.empty());
  }
  EXPECT_EQ(plane.T_map_base.translation, start.translation);
}

TEST(Navigator, StandsWhileItDoesNotKnowAndGoesOnAfterwards) {
  const NavigateOptions options;
  Plane plane(options, TwoRooms(), TwoRooms(), Rigid2(1.0, 1.0, 0.0));
  const Rigid2 goal(7.0, 4.0, 0.0);
  plane.DriveTo(goal, 4.0);
  plane.quality = PoseQuality{2.0 * options.max_position_deviation, 0.0};
  NavigatorOutput output = plane.Step();
  EXPECT_EQ(output.velocity.Speed(), 0.0);
  EXPECT_NE(output.text.find("uncertain"), std::string::npos);
  plane.quality = PoseQuality{};
  plane.laser_works = false;
  for (int i = 0; i < 10; ++i) output = plane.Step();
  EXPECT_EQ(output.velocity.Speed(), 0.0);
  EXPECT_NE(output.text.find("laser"), std::string::npos);
  plane.laser_works = true;
  EXPECT_EQ(plane.DriveTo(goal, 120.0).state, GoalState::kReached);
}

TEST(Navigator, DrivesByTheWheelsForAWhileThenLooksRound) {
  const NavigateOptions options;
  Plane plane(options, TwoRooms(), TwoRooms(), Rigid2(1.0, 1.0, 0.0));
  plane.source = PoseSource::kConfirmed;
  const Rigid2 goal(7.0, 4.0, 0.0);
  plane.DriveTo(goal, 4.0);
  const Eigen::Vector2d known = plane.T_map_base.translation;
  plane.source = PoseSource::kWheels;
  NavigatorOutput output;
  for (int i = 0; i < 100; ++i) output = plane.Step();
  EXPECT_EQ(output.state, GoalState::kDriving);
  EXPECT_NE(output.text.find("nothing but the wheels"), std::string::npos) << output.text;
  EXPECT_EQ(output.velocity.Speed(), 0.0);
  EXPECT_GT(output.velocity.yaw, 0.1) << "it looks round";
  const double driven = (plane.T_map_base.translation - known).norm();
  EXPECT_LT(driven, options.max_drive_unconfirmed + 0.3);
  EXPECT_GT(driven, 0.5) << "not at once";
  plane.source = PoseSource::kConfirmed;
  EXPECT_EQ(plane.DriveTo(goal, 120.0).state, GoalState::kReached);
}

TEST(Navigator, StandsWhileThePoseIsOldAndGoesOnAfterwards) {
  const NavigateOptions options;
  Plane plane(options, TwoRooms(), TwoRooms(), Rigid2(1.0, 1.0, 0.0));
  const Rigid2 goal(7.0, 4.0, 0.0);
  plane.DriveTo(goal, 4.0);
  plane.transform_age = 2.0 * options.max_transform_age;
  NavigatorOutput output = plane.Step();
  EXPECT_EQ(output.state, GoalState::kDriving);
  EXPECT_EQ(output.velocity.Speed(), 0.0);
  EXPECT_NE(output.text.find("old"), std::string::npos) << output.text;
  plane.transform_age = std::numeric_limits<double>::infinity();
  output = plane.Step();
  EXPECT_EQ(output.velocity.Speed(), 0.0);
  EXPECT_NE(output.text.find("no pose"), std::string::npos) << output.text;
  plane.transform_age = 0.0;
  for (int i = 0; i < 600 && output.state == GoalState::kDriving; ++i) output = plane.Step();
  EXPECT_EQ(output.state, GoalState::kReached) << output.text;
  ExpectAt(plane, goal, options);
}

TEST(Navigator, WhatItKnewOfTheLastGoalDoesNotCountForTheNext) {
  NavigateOptions options;
  options.hold_limit = 5.0;
  Plane plane(options, TwoRooms(), TwoRooms(), Rigid2(1.0, 1.0, 0.0));
  plane.quality = PoseQuality{2.0 * options.max_position_deviation, 0.0};
  EXPECT_EQ(plane.DriveTo(Rigid2(3.0, 1.0, 0.0), 4.0).state, GoalState::kDriving) << "held for 4 s";
  EXPECT_EQ(plane.DriveTo(Rigid2(3.0, 2.0, 0.0), 4.0).state, GoalState::kDriving) << "the patience begins anew";
  plane.quality = PoseQuality{};
  EXPECT_EQ(plane.DriveTo(Rigid2(3.0, 2.0, 0.0), 60.0).state, GoalState::kReached);
}

TEST(Navigator, TheSameGoalAgainIsReachedAtOnce) {
  const NavigateOptions options;
  Plane plane(options, TwoRooms(), TwoRooms(), Rigid2(1.0, 1.0, 0.0));
  const Rigid2 goal(2.5, 1.5, 1.0);
  ASSERT_EQ(plane.DriveTo(goal, 60.0).state, GoalState::kReached);
  const Rigid2 there = plane.T_map_base;
  for (int i = 0; i < 3; ++i) {
    const double begun = plane.time;
    EXPECT_EQ(plane.DriveTo(goal, 10.0).state, GoalState::kReached);
    EXPECT_LT(plane.time - begun, 2.0);
  }
  EXPECT_LT((plane.T_map_base.translation - there.translation).norm(), 0.1);
  EXPECT_EQ(plane.Step().state, GoalState::kNone) << "it is over";
}

TEST(Navigator, AGoalThatIsSentAgainAndAgainIsReached) {
  const NavigateOptions options;
  Plane plane(options, TwoRooms(), TwoRooms(), Rigid2(1.0, 1.0, 0.0));
  const Rigid2 goal(7.0, 4.0, 0.0);
  NavigatorOutput output;
  for (int i = 0; i < 100 && output.state != GoalState::kReached; ++i) output = plane.DriveTo(goal, 1.0);
  EXPECT_EQ(output.state, GoalState::kReached) << output.text;
  ExpectAt(plane, goal, options);
}

TEST(Navigator, ForgetsWhatItMarkedFromAWrongPlace) {
  Navigator navigator{NavigateOptions()};
  navigator.costmap().SetMap(Room(8.0, 5.0));
  PlanarScan scan;
  scan.range_max = 5.0;
  scan.ranges = {1.0F};
  navigator.AddSweep(0.0, scan, Rigid2(), Rigid2(), Rigid2(1.0, 2.0, 0.0));
  navigator.AddSweep(0.1, scan, Rigid2(), Rigid2(0.0, 0.1, 0.0), Rigid2(1.0, 2.13, 0.0));
  EXPECT_EQ(navigator.costmap().marks(), 2U);
  navigator.AddSweep(0.2, scan, Rigid2(), Rigid2(0.0, 0.1, 0.0), Rigid2(4.0, 2.0, 0.0));
  EXPECT_EQ(navigator.costmap().marks(), 1U);
}

TEST(Navigator, AGoalCountsOnceThePoseIsConfirmed) {
  NavigateOptions options;
  options.hold_limit = 10.0;
  Plane plane(options, TwoRooms(), TwoRooms(), Rigid2(1.0, 1.0, 0.0));
  plane.source = PoseSource::kWheels;
  const Rigid2 goal(1.5, 1.0, 0.0);
  NavigatorOutput output = plane.DriveTo(goal, 8.0);
  EXPECT_EQ(output.state, GoalState::kDriving);
  EXPECT_NE(output.text.find("wheels"), std::string::npos) << output.text;
  plane.source = PoseSource::kConfirmed;
  for (int i = 0; i < 100 && output.state == GoalState::kDriving; ++i) output = plane.Step();
  EXPECT_EQ(output.state, GoalState::kReached);
  ExpectAt(plane, goal, options);
  plane.source = PoseSource::kWheels;
  output = plane.DriveTo(goal, 60.0);
  EXPECT_EQ(output.state, GoalState::kAborted);
  EXPECT_NE(output.text.find("wheels"), std::string::npos) << output.text;
}

TEST(Navigator, GivesUpWhenItStaysLost) {
  NavigateOptions options;
  options.hold_limit = 5.0;
  Plane plane(options, TwoRooms(), TwoRooms(), Rigid2(1.0, 1.0, 0.0));
  plane.quality = PoseQuality{std::numeric_limits<double>::quiet_NaN(), 0.0};
  EXPECT_EQ(plane.DriveTo(Rigid2(3.0, 1.0, 0.0), 20.0).state, GoalState::kAborted);
}

TEST(Navigator, GivesUpWhenTheBaseDoesNotMove) {
  Plane plane(NavigateOptions(), TwoRooms(), TwoRooms(), Rigid2(1.0, 1.0, 0.0));
  plane.wheels_work = false;
  const NavigatorOutput output = plane.DriveTo(Rigid2(3.0, 1.0, 0.0), 30.0);
  EXPECT_EQ(output.state, GoalState::kAborted);
  EXPECT_NE(output.text.find("does not move"), std::string::npos) << output.text;
  EXPECT_EQ(output.velocity.Speed(), 0.0);
}

TEST(Navigator, ACancelledGoalIsNone) {
  Plane plane(NavigateOptions(), TwoRooms(), TwoRooms(), Rigid2(1.0, 1.0, 0.0));
  plane.DriveTo(Rigid2(3.0, 1.0, 0.0), 2.0);
  plane.navigator.Cancel();
  const NavigatorOutput output = plane.Step();
  EXPECT_EQ(output.state, GoalState::kNone);
  EXPECT_EQ(output.velocity.Speed(), 0.0);
}

}  // namespace
}  // namespace planar_vslam::test
