// Where people will walk, by where they walked before.
#include <gtest/gtest.h>

#include <cmath>

#include "planar_vslam/navigate/trails.h"
#include "plane.h"

namespace planar_vslam::test {
namespace {

constexpr double kLifetime = 120.0;  // s

Costmap Hall() {
  Costmap costmap{NavigateOptions()};
  costmap.SetMap(Room(12.0, 6.0));
  return costmap;
}

Track Seen(int id, const Motion& now, double time) {
  Track track;
  track.id = id;
  track.now = now;
  track.time = track.seen = time;
  track.walks = true;
  return track;
}

// What is seen of somebody who walks as told until `end` (s).
std::vector<Trail> TrailsOf(const Walker& walker, double end) {
  std::vector<Trail> trails;
  for (double time = 0.0; time <= end; time += 0.1) {
    const Eigen::Vector2d velocity = (walker.At(time + 0.05) - walker.At(time - 0.05 + 1e-9)) / 0.1;
    trails = ExtendTrails(std::move(trails), {Seen(3, {walker.At(time), velocity}, time)}, time, kLifetime);
  }
  return trails;
}

TEST(Trails, WhoWalksWhereNobodyDidGoesStraightOnAndBackFromAWall) {
  const Costmap costmap = Hall();
  const auto way = ForeseeWay({{9.0, 3.0}, {1.0, 0.0}}, 0.0, {}, costmap, 0.25, 24);
  ASSERT_EQ(way.size(), 24U);
  EXPECT_NEAR(way[3].position.x(), 10.0, 1e-9);
  EXPECT_LT(way.back().velocity.x(), 0.0);
  for (const Motion& motion : way) EXPECT_LT(motion.position.x(), 11.9);
}

TEST(Trails, WhoComesBackTurnsWhereTheyTurned) {
  const Walker walker{{3.0, 3.0}, {6.0, 3.0}, 0.75, 0.0};
  const Costmap costmap = Hall();
  const double now = 9.0;  // it came back at 8 s
  const auto way = ForeseeWay({walker.At(now), {0.75, 0.0}}, now, TrailsOf(walker, now), costmap, 0.25, 24);
  for (std::size_t i = 0; i < way.size(); ++i) {
    const double then = now + 0.25 * (static_cast<double>(i) + 1.0);
    EXPECT_LT((way[i].position - walker.At(then)).norm(), 0.25) << then;
  }
}

TEST(Trails, WhoWalksToAndFroSteadilyHasARhythm) {
  const Walker walker{{3.0, 3.0}, {6.0, 3.0}, 0.75, 0.0};
  const std::vector<Trail> trails = TrailsOf(walker, 40.0);
  const auto rhythm = RhythmOf(trails.front());
  ASSERT_TRUE(rhythm.has_value());
  EXPECT_NEAR(rhythm->period, 8.0, 0.05);
  for (double time = 40.5; time < 60.0; time += 0.5) {
    const auto place = PlaceInRhythm(trails.front(), *rhythm, time);
    ASSERT_TRUE(place.has_value());
    EXPECT_LT((*place - walker.At(time)).norm(), 0.1) << time;
  }
}

TEST(Trails, WhoWasNotSeenForLongEnoughHasNoRhythm) {
  const Walker walker{{3.0, 3.0}, {6.0, 3.0}, 0.75, 0.0};
  EXPECT_FALSE(RhythmOf(TrailsOf(walker, 9.0).front()).has_value());
  const Walker straight{{1.0, 3.0}, {50.0, 3.0}, 0.75, 0.0};
  EXPECT_FALSE(RhythmOf(TrailsOf(straight, 60.0).front()).has_value());
}

TEST(Trails, TheOtherDirectionIsAnotherWay) {
  const Walker walker{{3.0, 3.0}, {6.0, 3.0}, 0.75, 0.0};
  const Costmap costmap = Hall();
  const auto way = ForeseeWay({{5.0, 3.0}, {-0.75, 0.0}}, 3.9, TrailsOf(walker, 3.9), costmap, 0.25, 8);
  EXPECT_NEAR(way.back().position.x(), 3.5, 1e-9) << "it was only seen going the other way";
}

TEST(Trails, OldStepsAreForgottenAndThoseOutOfSightNotNoted) {
  std::vector<Trail> trails = ExtendTrails({}, {Seen(1, {{2.0, 2.0}, {1.0, 0.0}}, 0.0)}, 0.0, 10.0);
  ASSERT_EQ(trails.size(), 1U);
  Track unseen = Seen(2, {{5.0, 2.0}, {1.0, 0.0}}, 1.0);
  unseen.time = 2.0;
  trails = ExtendTrails(trails, {unseen}, 2.0, 10.0);
  EXPECT_EQ(trails.size(), 1U);
  EXPECT_TRUE(ExtendTrails(trails, {}, 11.0, 10.0).empty());
}

}  // namespace
}  // namespace planar_vslam::test
