#include <gtest/gtest.h>

#include <cmath>

#include "planar_vslam/sim/sensors.h"
#include "planar_vslam/sim/simulation.h"
#include "planar_vslam/sim/solids.h"
#include "sim_fixtures.h"

namespace planar_vslam {
namespace {

using test::BareRoom;

// Distance to the nearest of the walls and a circle, along a direction in the plane.
double AnalyticRange(const Eigen::Vector2d& from, double angle, const Eigen::Vector2d& room) {
  const Eigen::Vector2d d(std::cos(angle), std::sin(angle));
  double nearest = std::numeric_limits<double>::infinity();
  if (d.x() > 0) nearest = std::min(nearest, (room.x() - from.x()) / d.x());
  if (d.x() < 0) nearest = std::min(nearest, -from.x() / d.x());
  if (d.y() > 0) nearest = std::min(nearest, (room.y() - from.y()) / d.y());
  if (d.y() < 0) nearest = std::min(nearest, -from.y() / d.y());
  return nearest;
}

TEST(LaserSensor, MeasuresWallsToTheMillimetre) {
  const World world = BareRoom();
  const Scene scene(world, 1);
  LaserSensor laser(world.laser, 1);
  for (const Rigid2& T_world_base : {Rigid2(1.3, 0.8, 0.3), Rigid2(4.9, 4.1, -2.5), Rigid2(3.0, 2.5, M_PI)}) {
    const PlanarScan scan = laser.Scan(scene, {}, Embed3(T_world_base) * world.laser.T_base_laser());
    ASSERT_EQ(scan.ranges.size(), 541u);
    for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
      const double angle = T_world_base.angle + scan.angle_min + static_cast<double>(i) * scan.angle_increment;
      EXPECT_NEAR(scan.ranges[i], AnalyticRange(T_world_base.translation, angle, world.room.size.head<2>()), 1e-3)
          << "beam " << i;
    }
  }
}

TEST(LaserSensor, SeesLegsButNotTableTopsNorPosters) {
  World world = BareRoom();
  ObjectSpec table;
  table.kind = ObjectKind::kTable;
  table.at = {3.0, 1.5};
  table.size = {1.0, 1.0};
  table.height = 0.74;
  world.objects.push_back(table);
  world.posters.push_back({Wall::kEast, 1.5, 0.5, {0.8, 0.8}, {"plain", 40}});
  const Scene scene(world, 1);
  const Eigen::Vector3d from(1.0, 1.5, 0.25), ahead(1, 0, 0);
  EXPECT_NEAR(scene.Range(from, ahead, 8.0), 5.0, 1e-3) << "under the table, through the poster, to the wall";
  EXPECT_NEAR(scene.Range(from + Eigen::Vector3d(0, 0.475, 0), ahead, 8.0), 1.5, 1e-3) << "a leg's face";
  EXPECT_NEAR(scene.Range(from + Eigen::Vector3d(0, 0, 0.47), ahead, 8.0), 1.5, 1e-3) << "the top's edge at 0.72 m";
}

TEST(LaserSensor, ReportsNoReturnBeyondItsRange) {
  World world = BareRoom();
  world.laser.range_max = 2.0;
  const Scene scene(world, 1);
  LaserSensor laser(world.laser, 1);
  const PlanarScan scan = laser.Scan(scene, {}, Embed3(Rigid2(1.0, 2.5, M_PI)) * world.laser.T_base_laser());
  EXPECT_NEAR(scan.ranges[270], 1.0f, 1e-3f);
  EXPECT_TRUE(std::isinf(scan.ranges[0]));
}

TEST(LaserSensor, NoiseHasTheStatedDeviation) {
  World world = BareRoom();
  const Scene scene(world, 1);
  const Rigid3 T_world_laser = Embed3(Rigid2(3.0, 2.5, 0.0)) * world.laser.T_base_laser();
  const PlanarScan clean = LaserSensor(world.laser, 1).Scan(scene, {}, T_world_laser);
  world.laser.noise = 0.02;
  LaserSensor laser(world.laser, 1);
  double sum = 0.0, squares = 0.0;
  long count = 0;
  for (int repeat = 0; repeat < 20; ++repeat) {
    const PlanarScan scan = laser.Scan(scene, {}, T_world_laser);
    for (std::size_t i = 0; i < scan.ranges.size(); ++i, ++count) {
      const double error = static_cast<double>(scan.ranges[i] - clean.ranges[i]);
      sum += error;
      squares += error * error;
    }
  }
  EXPECT_NEAR(sum / static_cast<double>(count), 0.0, 1e-3);
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(count)), 0.02, 1e-3);
}

// The odometer fed with a whole drive at 50 Hz; the last reading.
Rigid2 LastReading(const Drive& drive, const OdometrySpec& spec, std::uint64_t seed) {
  WheelOdometer odometer(spec, BaseKind::kOmnidirectional, seed);
  OdometryReading reading;
  for (int i = 0; i * 0.02 <= drive.duration(); ++i)
    reading = odometer.Update({i * 20000000LL}, Embed3(drive.At(i * 0.02)));
  return reading.T_odom_base;
}

TEST(WheelOdometer, IntegratesToTheTruthWithoutErrors) {
  const World world = BareRoom();
  const Drive drive = *PlanDrive(world);
  WheelOdometer odometer(world.odometry, world.drive.base, 1);
  for (int i = 0; i * 0.02 <= drive.duration(); ++i) {
    const OdometryReading reading = odometer.Update({i * 20000000LL}, Embed3(drive.At(i * 0.02)));
    const Rigid2 T_odom_base = drive.At(0.0).Inverse() * drive.At(i * 0.02);
    const Rigid2 error = T_odom_base.Inverse() * reading.T_odom_base;
    ASSERT_LT(error.translation.norm() + std::abs(error.angle), 1e-9);
  }
}

TEST(WheelOdometer, ScalesDistancesAndRotations) {
  World world = BareRoom();
  world.drive.waypoints = {{4.5, 1.5}};
  world.odometry.scale = 1.1;
  const Drive straight = *PlanDrive(world);
  const double distance = straight.At(straight.duration()).translation.x() - 1.5;
  EXPECT_NEAR(LastReading(straight, world.odometry, 1).translation.x(), 1.1 * distance, 1e-3);
  world.odometry.yaw_scale = 1.05;
  WheelOdometer odometer(world.odometry, world.drive.base, 1);
  OdometryReading reading;
  for (int i = 0; i <= 100; ++i) reading = odometer.Update({i}, Embed3(Rigid2(0, 0, 0.01 * i)));
  EXPECT_NEAR(reading.T_odom_base.angle, 1.05, 1e-9);
}

TEST(WheelOdometer, TwoDrivenWheelsTellOfNoWaySideways) {
  OdometrySpec noisy;
  noisy.translation_noise = 0.05;
  for (const BaseKind base : {BaseKind::kDifferential, BaseKind::kOmnidirectional}) {
    WheelOdometer odometer(noisy, base, 1);
    double sideways = 0.0;
    for (int i = 0; i <= 100; ++i)
      sideways = std::max(sideways,
                          std::abs(odometer.Update({i}, Embed3(Rigid2(0.01 * i, 0, 0))).T_odom_base.translation.y()));
    EXPECT_EQ(sideways == 0.0, base == BaseKind::kDifferential) << sideways;
  }
}

TEST(WheelOdometer, NoiseGrowsWithTheSquareRootOfTheDistance) {
  World world = BareRoom();
  world.drive.waypoints = {{4.5, 1.5}};
  const Drive drive = *PlanDrive(world);
  world.odometry.translation_noise = 0.01;
  constexpr int kRuns = 400;
  double squares = 0.0;
  const double distance = drive.At(drive.duration()).translation.x() - 1.5;
  for (int run = 0; run < kRuns; ++run) {
    const double error = LastReading(drive, world.odometry, static_cast<std::uint64_t>(run)).translation.x() - distance;
    squares += error * error;
  }
  EXPECT_NEAR(std::sqrt(squares / kRuns), 0.01 * std::sqrt(distance), 0.002);
}

TEST(MountShake, HasTheStatedDeviationAndRemembers) {
  MountShake shake(0.01, 0.1, 5);
  double squares = 0.0, products = 0.0;
  Eigen::Vector3d last = LogSo3(shake.Next());
  constexpr int kCount = 20000;
  for (int i = 0; i < kCount; ++i) {
    const Eigen::Vector3d now = LogSo3(shake.Next());
    squares += now.squaredNorm() / 3.0;
    products += now.dot(last) / 3.0;
    last = now;
  }
  EXPECT_NEAR(std::sqrt(squares / kCount), 0.01, 0.0005);
  EXPECT_NEAR(products / squares, std::exp(-0.1 / 0.3), 0.03);
  EXPECT_EQ(MountShake(0.0, 0.1, 5).Next().w(), 1.0);
}

}  // namespace
}  // namespace planar_vslam
