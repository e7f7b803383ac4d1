#include "planar_vslam/sim/floor.h"

#include <gtest/gtest.h>

#include <cmath>

#include "planar_vslam/sim/sensors.h"
#include "planar_vslam/sim/simulation.h"
#include "planar_vslam/sim/truth_grid.h"
#include "sim_fixtures.h"

namespace planar_vslam {
namespace {

// Five degrees over 3 m, a level metre, and down again: x from 1.5 to 8.5 m.
World RoomWithRamp() {
  World world = test::BareRoom();
  world.room.size = {10.0, 4.0, 3.0};
  ObjectSpec ramp;
  ramp.kind = ObjectKind::kRamp;
  ramp.at = {5.0, 2.0};
  ramp.size = {7.0, 2.0};
  ramp.plateau = 1.0;
  ramp.height = 3.0 * std::tan(5.0 * M_PI / 180.0);
  world.objects.push_back(ramp);
  world.drive.start = Rigid2(0.6, 2.0, 0.0);
  world.drive.waypoints = {{9.4, 2.0}};
  return world;
}

TEST(Floor, IsFlatWhereNothingLies) {
  const Rigid2 T_world_base(1.2, 0.7, 0.4);
  const Rigid3 T = Floor(test::BareRoom()).Stand(T_world_base);
  EXPECT_EQ(T.translation, Embed3(T_world_base).translation);
  EXPECT_EQ(T.rotation.coeffs(), Embed3(T_world_base).rotation.coeffs());
}

TEST(Floor, ARampPitchesAndLiftsTheRobot) {
  const Floor floor(RoomWithRamp());
  EXPECT_NEAR(floor.Height({3.0, 2.0}), 1.5 * std::tan(5.0 * M_PI / 180.0), 1e-9);
  const Rigid3 up = floor.Stand(Rigid2(3.0, 2.0, 0.0));
  EXPECT_NEAR(up.translation.z(), floor.Height({3.0, 2.0}), 1e-9);
  EXPECT_NEAR(std::asin((up.rotation * Eigen::Vector3d::UnitX()).z()), 5.0 * M_PI / 180.0, 1e-9) << "looks up";
  const Rigid3 across = floor.Stand(Rigid2(3.0, 2.0, M_PI_2));
  EXPECT_NEAR((across.rotation * Eigen::Vector3d::UnitX()).z(), 0.0, 1e-9);
  EXPECT_NEAR(std::asin((across.rotation * Eigen::Vector3d::UnitY()).z()), -5.0 * M_PI / 180.0, 1e-9);
  EXPECT_NEAR(floor.Stand(Rigid2(5.0, 2.0, 0.3)).R()(2, 2), 1.0, 1e-12) << "level on top";
  EXPECT_NEAR((floor.Stand(Rigid2(7.0, 2.0, 0.0)).rotation * Eigen::Vector3d::UnitX()).z(),
              -std::sin(5.0 * M_PI / 180.0), 1e-9);
}

TEST(Floor, OdometryMeasuresTheLengthOfTheSlope) {
  const World world = RoomWithRamp();
  const Floor floor(world);
  WheelOdometer odometer(world.odometry, world.drive.base, 1);
  OdometryReading reading;
  for (int i = 0; i <= 880; ++i) reading = odometer.Update({i}, floor.Stand(Rigid2(0.6 + 0.01 * i, 2.0, 0.0)));
  const double slopes = 6.0 / std::cos(5.0 * M_PI / 180.0);
  EXPECT_NEAR(reading.T_odom_base.translation.x(), 8.8 - 6.0 + slopes, 5e-3);
  EXPECT_NEAR(reading.T_odom_base.angle, 0.0, 1e-9);
}

TEST(Floor, TruthOfASimulationFollowsTheRamp) {
  World world = RoomWithRamp();
  SimulationOptions options;
  options.render = false;
  Simulation simulation = Simulation::Create(world, options).value();
  double highest = 0.0;
  while (const auto event = simulation.Next()) highest = std::max(highest, event->T_world_base.translation.z());
  EXPECT_NEAR(highest, world.objects[0].height, 1e-6);
}

TEST(Floor, RampsAreNoObstaclesButTheirSidesAre) {
  World world = RoomWithRamp();
  const TruthGrid grid = MakeTruthGrid(world, kBodyLow, kBodyHigh);
  EXPECT_FALSE(grid.Occupied(grid.width / 2, grid.height / 2));
  world.drive.waypoints = {{5.0, 2.0}, {5.0, 3.5}};
  EXPECT_NE(PlanDrive(world).error().message.find("the edge of a ramp"), std::string::npos);
}

TEST(Floor, ALevelLaserMeetsTheRampWhereItIsAsHighAsTheLaser) {
  const World world = RoomWithRamp();
  const Scene scene(world, 1);
  const double meets = 1.5 + 0.25 / std::tan(5.0 * M_PI / 180.0);
  EXPECT_NEAR(scene.Range({0.5, 2.0, 0.25}, {1, 0, 0}, 10.0), meets - 0.5, 1e-3);
}

}  // namespace
}  // namespace planar_vslam
