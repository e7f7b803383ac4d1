// People who see the robot: they stop in front of it, go on when it leaves, and turn back when it does not.
#include "planar_vslam/sim/people_motion.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "planar_vslam/sim/live_simulation.h"
#include "sim_fixtures.h"

namespace planar_vslam {
namespace {

constexpr double kRadius = 0.25, kStep = 0.005;  // m, s
const PersonSpec kPerson{{{1.0, 1.0}, {5.0, 1.0}}, 0.8, 0.0, 1.75};

Eigen::Vector2d PlaceOf(const PeopleMotion& people) {
  return WalkerAt(kPerson, people.times()[0]).T_world_walker.translation;
}

TEST(PeopleMotion, GoesByEverybodysTimeWhereNobodyIsInTheWay) {
  PeopleMotion people({kPerson}, kRadius);
  for (int i = 0; i < 1000; ++i) people.Step({3.0, 4.0}, kStep);
  EXPECT_NEAR(people.times()[0], 5.0, 1e-9);
}

TEST(PeopleMotion, StopsInFrontOfTheRobotAndGoesOnWhenItLeaves) {
  PeopleMotion people({kPerson}, kRadius);
  for (int i = 0; i < 800; ++i) people.Step({3.0, 1.0}, kStep);
  EXPECT_NEAR(PlaceOf(people).x(), 3.0 - kRadius - 0.25 - 0.5, 0.01);
  for (int i = 0; i < 200; ++i) people.Step({3.0, 4.0}, kStep);
  EXPECT_GT(PlaceOf(people).x(), 2.7);
}

TEST(PeopleMotion, TurnsBackAfterAWhile) {
  PeopleMotion people({kPerson}, kRadius);
  double farthest = 0.0;
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector2d before = PlaceOf(people);
    people.Step({3.0, 1.0}, kStep);
    EXPECT_LT((PlaceOf(people) - before).norm(), 0.02) << "no jump";
    farthest = std::max(farthest, PlaceOf(people).x());
  }
  EXPECT_LT(PlaceOf(people).x(), farthest - 0.5);
}

TEST(PeopleMotion, NobodyWalksIntoARobotThatStands) {
  World world = test::BareRoom();
  world.people.push_back(kPerson);
  for (const bool wait : {false, true}) {
    LiveOptions options;
    options.render = false;
    options.start = Rigid2(3.0, 1.0, 0.0);
    options.people_wait = wait;
    LiveSimulation simulation = LiveSimulation::Create(world, options).value();
    while (simulation.now() < 11.0) simulation.Step();
    EXPECT_EQ(simulation.base().bumps, wait ? 0 : 1) << "one contact until the robot moves";
  }
}

}  // namespace
}  // namespace planar_vslam
