#include "planar_vslam/sim/drive.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sim_fixtures.h"

namespace planar_vslam {
namespace {

using test::BareRoom;

TEST(Drive, PassesTheWaypointsAndStopsAtTheLast) {
  World world = BareRoom();
  world.drive.waypoints = {{4.5, 1.5}, {4.5, 3.5}, {1.5, 3.5}};
  const Expected<Drive> drive = PlanDrive(world);
  ASSERT_TRUE(drive.ok()) << drive.error().message;
  constexpr double kCornerCut = 0.4;  // m
  for (const Eigen::Vector2d& waypoint : world.drive.waypoints) {
    double nearest = 1e9;
    for (double t = 0.0; t < drive->duration(); t += 0.05)
      nearest = std::min(nearest, (drive->At(t).translation - waypoint).norm());
    EXPECT_LT(nearest, kCornerCut) << waypoint.transpose();
  }
  EXPECT_LT((drive->At(drive->duration()).translation - world.drive.waypoints.back()).norm(), 0.1);
}

TEST(Drive, KeepsToItsSpeedsAndAccelerations) {
  World world = BareRoom();
  world.drive.shuffle = 0.5;
  const Drive drive = *PlanDrive(world);
  const double shuffle_end = 1.875 * 0.5 / world.drive.sideways_speed;
  constexpr double dt = Drive::kStep;
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  double fastest = 0.0, leftwards = 0.0;
  for (double t = 0.0; t + dt <= drive.duration(); t += dt) {
    const Eigen::Vector3d twist = LogSe2(drive.At(t).Inverse() * drive.At(t + dt)) / dt;
    EXPECT_LT(twist.x(), world.drive.speed + 1e-6);
    EXPECT_GT(twist.x(), -1e-6) << "never backwards";
    EXPECT_LT(std::abs(twist.z()), world.drive.turn_rate + 1e-6);
    EXPECT_LT(twist.y(), world.drive.sideways_speed + 1e-3);
    if (t > shuffle_end + 0.1) {
      EXPECT_NEAR(twist.y(), 0.0, 1e-6) << "no sideways slip when driving forward";
      EXPECT_LT(std::abs(twist.x() - last.x()), (world.drive.acceleration + 0.1) * dt);
    }
    fastest = std::max(fastest, twist.x());
    leftwards += twist.y() * dt;
    last = twist;
  }
  EXPECT_NEAR(fastest, world.drive.speed, 0.01);
  EXPECT_NEAR(leftwards, 0.5, 1e-3);
}

TEST(Drive, LapsCloseTheLoop) {
  World world = BareRoom();
  world.drive.waypoints = {{2.0, 1.5}, {4.5, 1.5}, {4.5, 3.5}, {1.5, 3.5}, {1.5, 1.6}};
  world.drive.laps = 1.2;
  const Drive drive = *PlanDrive(world);
  double length = 0.0, turned = 0.0, nearest_return = 1e9;
  for (double t = 0.0; t < drive.duration(); t += 0.05) {
    const Rigid2 step = drive.At(t).Inverse() * drive.At(t + 0.05);
    length += step.translation.norm();
    turned += step.angle;
    if (turned > 5.0)
      nearest_return = std::min(nearest_return, (drive.At(t).translation - Eigen::Vector2d(3, 1.5)).norm());
  }
  EXPECT_GT(turned, 1.9 * M_PI);
  EXPECT_LT(nearest_return, 0.15);
  EXPECT_GT(length, 8.0);
}

TEST(Drive, TurnsBackToAWaypointBehind) {
  World world = BareRoom();
  world.drive.start = Rigid2(3.0, 2.5, 0.0);
  world.drive.waypoints = {{1.0, 2.5}};
  const Expected<Drive> drive = PlanDrive(world);
  ASSERT_TRUE(drive.ok()) << drive.error().message;
  EXPECT_LT((drive->At(drive->duration()).translation - world.drive.waypoints[0]).norm(), 0.1);
}

TEST(Drive, RefusesToTouchThings) {
  World world = BareRoom();
  world.source = "room.yaml";
  ObjectSpec box;
  box.at = {3.0, 1.6};
  world.objects.push_back(box);
  const Expected<Drive> drive = PlanDrive(world);
  ASSERT_FALSE(drive.ok());
  EXPECT_NE(drive.error().message.find("room.yaml: drive: the robot of radius 0.25 m touches objects[0], a box"),
            std::string::npos)
      << drive.error().message;
  world.objects.clear();
  world.drive.waypoints = {{5.9, 1.5}};
  EXPECT_NE(PlanDrive(world).error().message.find("a wall"), std::string::npos);
}

}  // namespace
}  // namespace planar_vslam
