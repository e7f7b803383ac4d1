// People seen by a laser that stands, and followed.
#include <gtest/gtest.h>

#include <cmath>

#include "plane.h"

namespace planar_vslam::test {
namespace {

// A robot that stands in a hall and looks.
class Watching {
 public:
  explicit Watching(const Rigid2& at, OccupancyGrid2d truth = Room(10.0, 6.0))
      : plane(NavigateOptions(), Room(10.0, 6.0), std::move(truth), at) {}

  void Watch(double seconds) {
    for (const double end = plane.time + seconds; plane.time < end;) plane.Step();
  }
  std::vector<Track> Walking() const {
    std::vector<Track> walking;
    for (const Track& track : plane.navigator.people().tracks()) {
      if (track.walks) walking.push_back(track);
    }
    return walking;
  }

  Plane plane;
};

TEST(PeopleTracks, SomebodyWhoWalksIsFollowedOverManyTurns) {
  for (const double speed : {0.5, 0.8, 1.0}) {
    Watching watching(Rigid2(1.0, 3.0, 0.0));
    watching.plane.people = {{{4.0, 1.0}, {4.0, 5.0}, speed, 0.0}};
    watching.Watch(4.0);
    double worst = 0.0;
    for (int i = 0; i < 250; ++i) {
      watching.plane.Step();
      const auto walking = watching.Walking();
      ASSERT_EQ(walking.size(), 1U) << watching.plane.time;
      const Eigen::Vector2d truth = watching.plane.people[0].At(watching.plane.time - Plane::kPeriod);
      worst = std::max(worst, (walking[0].now.position - truth).norm());
    }
    EXPECT_LT(worst, 0.45) << speed;
  }
}

TEST(PeopleTracks, ItsSpeedIsKnown) {
  Watching watching(Rigid2(1.0, 3.0, 0.0));
  watching.plane.people = {{{5.0, 0.6}, {5.0, 5.4}, 0.8, 0.0}};
  watching.Watch(4.0);
  ASSERT_EQ(watching.Walking().size(), 1U);
  const Motion now = watching.Walking()[0].now;
  EXPECT_NEAR(now.velocity.y(), 0.8, 0.25);
  EXPECT_NEAR(now.velocity.x(), 0.0, 0.25);
}

TEST(PeopleTracks, TwoPeopleAreTwo) {
  Watching watching(Rigid2(1.0, 3.0, 0.0));
  watching.plane.people = {{{4.0, 1.0}, {4.0, 5.0}, 0.7, 0.0}, {{6.0, 5.0}, {6.0, 1.0}, 0.6, 0.0}};
  watching.Watch(3.0);
  EXPECT_EQ(watching.Walking().size(), 2U);
}

TEST(PeopleTracks, WhoIsOutOfSightStaysInMindAndComesBackAsTheSame) {
  // Behind a pillar of the truth that the map does not have.
  OccupancyGrid2d truth = Room(10.0, 6.0);
  Fill(&truth, 3.0, 2.6, 3.4, 3.4);
  Watching watching(Rigid2(1.0, 3.0, 0.0), truth);
  watching.plane.people = {{{5.0, 0.8}, {5.0, 5.2}, 0.8, 0.0}};
  watching.Watch(1.6);
  ASSERT_EQ(watching.Walking().size(), 1U);
  const int id = watching.Walking()[0].id;
  for (int i = 0; i < 30; ++i) {
    watching.plane.Step();
    ASSERT_EQ(watching.Walking().size(), 1U) << watching.plane.time;
    EXPECT_EQ(watching.Walking()[0].id, id);
  }
}

TEST(PeopleTracks, WhoIsGoneIsForgotten) {
  Watching watching(Rigid2(1.0, 3.0, 0.0));
  watching.plane.people = {{{4.0, 1.0}, {4.0, 5.0}, 0.8, 0.0}};
  watching.Watch(3.0);
  EXPECT_EQ(watching.Walking().size(), 1U);
  watching.plane.people.clear();
  watching.Watch(2.0);
  EXPECT_TRUE(watching.Walking().empty());
}

TEST(PeopleTracks, WhoStopsBecomesAnObstacle) {
  Watching watching(Rigid2(1.0, 3.0, 0.0));
  watching.plane.people = {{{4.0, 1.0}, {4.0, 5.0}, 0.8, 0.0}};
  watching.Watch(3.0);
  const Eigen::Vector2d there = watching.plane.people[0].At(watching.plane.time);
  watching.plane.people = {{there, there + Eigen::Vector2d(0.0, 1.0), 1e-6, 0.0}};
  watching.Watch(4.0);
  EXPECT_TRUE(watching.Walking().empty());
  EXPECT_LT(watching.plane.navigator.costmap().Clearance(there), 0.0);
}

}  // namespace
}  // namespace planar_vslam::test
