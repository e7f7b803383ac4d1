// How fast along a path, and out of whose way: with people whose places are given.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "planar_vslam/navigate/give_way.h"
#include "planar_vslam/navigate/speed_plan.h"
#include "plane.h"

namespace planar_vslam::test {
namespace {

using Way = std::function<Eigen::Vector2d(double time)>;

Foresight Foreseen(const std::vector<Way>& people, const NavigateOptions& options) {
  Foresight foresight;
  for (const Way& way : people) {
    std::vector<Eigen::Vector2d> places;
    for (double t = 0.0; t <= options.foresight; t += Foresight::kPeriod) places.push_back(way(t));
    foresight.people.push_back(places);
  }
  return foresight;
}

// Along x from the origin, to a goal so many metres away.
SpeedProblem Straight(const NavigateOptions& options, double length) {
  SpeedProblem problem;
  for (int i = 0; i < SpeedPlaces(options) && i * SpeedStep(options) <= length; ++i) {
    problem.path.emplace_back(i * SpeedStep(options), 0.0);
    problem.limit.push_back(options.max_speed);
    problem.walked.push_back(false);
  }
  problem.beyond = std::max(0.0, length - SpeedStep(options) * static_cast<double>(problem.path.size() - 1));
  return problem;
}

// What the robot does that plans again every period: the places along the path.
std::vector<double> Driven(const NavigateOptions& options, double length, const Way& person, double seconds) {
  std::vector<double> places{0.0};
  double speed = 0.0;
  for (double time = 0.0; time < seconds; time += Foresight::kPeriod) {
    SpeedProblem problem = Straight(options, length - places.back());
    for (Eigen::Vector2d& p : problem.path) p.x() += places.back();
    problem.speed = speed;
    const auto from_now = [&](double t) { return person(time + t); };
    const double next = PlanSpeed(problem, Foreseen({from_now}, options), options).speed;
    places.push_back(places.back() + 0.5 * (speed + next) * Foresight::kPeriod);
    speed = next;
    if (places.back() > length - 0.02) break;
  }
  return places;
}

TEST(SpeedPlan, WithNobodyNearItGoesAtOnce) {
  const NavigateOptions options;
  const Way far = [](double) { return Eigen::Vector2d(0.0, 9.0); };
  for (const double length : {0.3, 1.0, 2.7, 6.0}) {
    const SpeedPlan plan = PlanSpeed(Straight(options, length), Foreseen({far}, options), options);
    EXPECT_GT(plan.speed, 0.0) << length;
    EXPECT_FALSE(plan.contact);
    const auto places = Driven(options, length, far, 40.0);
    EXPECT_LT(static_cast<double>(places.size()) * Foresight::kPeriod, length / options.max_speed + 3.0) << length;
  }
}

TEST(SpeedPlan, GoesThroughBetweenPassesAndNeverTouches) {
  const NavigateOptions options;
  for (const double start : {0.0, 1.0, 2.0, 3.0, 5.0, 6.0}) {
    const Walker walker{{1.5, -2.0}, {1.5, 2.0}, 0.8, start};
    const Way way = [&](double t) { return walker.At(t); };
    const auto places = Driven(options, 3.5, way, 60.0);
    EXPECT_GT(places.back(), 3.4) << start;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const double time = static_cast<double>(i) * Foresight::kPeriod;
      EXPECT_GT((way(time) - Eigen::Vector2d(places[i], 0.0)).norm(), options.robot_radius + options.person_radius);
    }
  }
}

TEST(SpeedPlan, WaitsBeforeALaneThatIsNeverFreeLongEnough) {
  const NavigateOptions options;
  const Walker walker{{2.0, -0.6}, {2.0, 0.6}, 1.0, 0.0};
  const auto places = Driven(
      options, 4.0, [&](double t) { return walker.At(t); }, 30.0);
  EXPECT_GT(places.back(), 0.8) << "as near as is safe";
  EXPECT_LT(places.back(), 1.4);
}

TEST(SpeedPlan, AGoalInALaneIsEnteredOnlyForAsLongAsItIsFree) {
  const NavigateOptions options;
  // Somebody passes the goal once, in 7 s.
  const Way way = [](double t) { return Eigen::Vector2d(1.5, 0.8 * (t - 7.0)); };
  SpeedProblem problem = Straight(options, 1.5);
  problem.hold = 0.2;
  EXPECT_LT(PlanSpeed(problem, Foreseen({way}, options), options).cost, 8.0) << "there, and gone in time";
  problem.hold = 3.0;
  EXPECT_GT(PlanSpeed(problem, Foreseen({way}, options), options).cost, 8.0) << "not long enough: later";
}

TEST(SpeedPlan, SaysWhenSomebodyWillWalkIntoItWhateverItsSpeed) {
  const NavigateOptions options;
  const Way along = [](double t) { return Eigen::Vector2d(3.0 - 0.8 * t, 0.0); };
  const SpeedPlan plan = PlanSpeed(Straight(options, 6.0), Foreseen({along}, options), options);
  EXPECT_TRUE(plan.contact);
  EXPECT_GT(plan.contact_in, 1.5);
}

class GiveWay : public testing::Test {
 protected:
  GiveWay() : costmap_(options_) { costmap_.SetMap(Room(8.0, 6.0)); }

  WayOut Find(const Rigid2& T_map_base, const Way& person) {
    const Surroundings surroundings(costmap_, options_, T_map_base, {});
    const auto nowhere = [](const Eigen::Vector2d&) { return false; };
    return FindWayOut(Foreseen({person}, options_), options_, T_map_base, {}, surroundings, nowhere);
  }

  NavigateOptions options_;
  Costmap costmap_;
};

TEST_F(GiveWay, StandsWhereNobodyComes) {
  const WayOut way = Find(Rigid2(4.0, 3.0, 0.0), [](double) { return Eigen::Vector2d(1.0, 1.0); });
  EXPECT_EQ(way.velocity.Speed(), 0.0);
  EXPECT_EQ(way.velocity.yaw, 0.0);
}

TEST_F(GiveWay, DrivesAheadOrBackOutOfALaneAcross) {
  for (const double beside : {0.2, -0.2}) {
    const Way across = [&](double t) { return Eigen::Vector2d(4.0 - beside, 5.5 - 0.8 * t); };
    const WayOut way = Find(Rigid2(4.0, 3.0, 0.0), across);
    EXPECT_FALSE(way.contact);
    EXPECT_GT(way.velocity.x * beside, 0.0) << "to the side that is nearer";
  }
}

TEST_F(GiveWay, TurnsFirstWhereTheLaneIsAlongIt) {
  const WayOut way = Find(Rigid2(4.0, 1.0, M_PI_2), [](double t) { return Eigen::Vector2d(4.0, 5.5 - 0.6 * t); });
  EXPECT_FALSE(way.contact);
  EXPECT_NE(way.velocity.yaw, 0.0);
}

TEST_F(GiveWay, DoesNotDriveIntoAWall) {
  // A wall close ahead: the way back is the only one.
  const Way across = [](double t) { return Eigen::Vector2d(7.6, 5.9 - 0.8 * t); };
  const WayOut way = Find(Rigid2(7.55, 3.0, 0.0), across);
  EXPECT_LT(way.velocity.x, 0.0);
}

}  // namespace
}  // namespace planar_vslam::test
