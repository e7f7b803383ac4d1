#include "planar_vslam/pipeline/laser_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "planar_vslam/pipeline/motion_comparison.h"

namespace planar_vslam {
namespace {

// Range from a place inside a room of 8 by 5 m that a cupboard of 2 by 1 m stands in, at one corner.
double RangeIn(const Eigen::Vector2d& from, double angle) {
  const Eigen::Vector2d along(std::cos(angle), std::sin(angle));
  const double x_wall = along.x() > 0.0 ? (4.0 - from.x()) / along.x() : (-4.0 - from.x()) / along.x();
  const double y_wall = along.y() > 0.0 ? (2.5 - from.y()) / along.y() : (-2.5 - from.y()) / along.y();
  double range = std::min(along.x() == 0.0 ? y_wall : x_wall, along.y() == 0.0 ? x_wall : y_wall);
  const double side = (2.0 - from.x()) / along.x(), front = (1.5 - from.y()) / along.y();
  if (side > 0.0 && from.y() + side * along.y() > 1.5) range = std::min(range, side);
  if (front > 0.0 && from.x() + front * along.x() > 2.0) range = std::min(range, front);
  return range;
}

struct Laser {
  double turned = 0.0;        // rad, to the left of what is said
  bool hangs = false;         // and tf says so
  bool hangs_unsaid = false;  // but tf does not
  bool clockwise = false;     // the order of its beams
  double field = 2.0 * M_PI;  // rad
  double wiggle = 0.3;        // rad/s, of the robot
};

LaserFrame Sweep(const Rigid2& T_room_base, const Laser& laser, double t, std::mt19937* generator) {
  constexpr int kBeams = 360;
  std::normal_distribution<double> noise(0.0, 0.01);
  const Eigen::Quaterniond over(laser.hangs ? Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX())
                                            : Eigen::AngleAxisd::Identity());
  LaserFrame frame;
  frame.T_base_laser = Rigid3(over, Eigen::Vector3d(0.2, 0.0, 0.3));
  PlanarScan& scan = frame.scan;
  scan.stamp = Timestamp::FromSeconds(t);
  const double sign = laser.clockwise ? -1.0 : 1.0;
  scan.angle_min = -sign * 0.5 * laser.field;
  scan.angle_increment = sign * laser.field / kBeams;
  scan.range_max = 20.0;
  const Eigen::Vector2d place = T_room_base * Eigen::Vector2d(0.2, 0.0);
  for (int i = 0; i < kBeams; ++i) {
    double angle = scan.angle_min + scan.angle_increment * i;
    if (laser.hangs != laser.hangs_unsaid) angle = -angle;
    const double range = RangeIn(place, T_room_base.angle + angle + laser.turned) + noise(*generator);
    scan.ranges.push_back(i % 40 == 0 ? std::numeric_limits<float>::infinity() : static_cast<float>(range));
  }
  return frame;
}

// Round the room at 0.5 m/s, with bends; the wheels as they should be, the laser's stamps late.
LaserCheck Drive(const Laser& laser, double seconds = 40.0, double late = 0.0, OdometryBuffer* wheels = nullptr) {
  LaserCheck check;
  std::mt19937 generator(3);
  Rigid2 T_room_base(-2.0, -1.0, 0.0);
  for (int i = 0; i < seconds * 20; ++i) {
    const double t = 0.05 * i;
    T_room_base = T_room_base * ExpSe2(Eigen::Vector3d(0.025, 0.0, 0.05 * (0.35 + laser.wiggle * std::sin(0.8 * t))));
    if (i % 2 == 0) check.Add(Sweep(T_room_base, laser, t + late, &generator));
    const OdometryReading reading{Timestamp::FromSeconds(t), T_room_base};
    check.Add(reading);
    if (wheels != nullptr) wheels->Push(reading);
  }
  return check;
}

double Degrees(const LaserCheck& check) { return RadiansToDegrees(check.Turned().value_or(0.0)); }

TEST(LaserCheck, AGoodLaserIsNotTurned) {
  Laser laser;
  for (const bool hangs : {false, true}) {
    for (const bool clockwise : {false, true}) {
      for (const double field : {2.0 * M_PI, 1.5 * M_PI, M_PI}) {
        laser = {0.0, hangs, false, clockwise, field};
        const LaserCheck check = Drive(laser);
        EXPECT_FALSE(check.Turned().has_value()) << Degrees(check) << " deg: " << hangs << clockwise << field;
        EXPECT_FALSE(check.IsUpsideDown());
      }
    }
  }
}

TEST(LaserCheck, AYawThatIsWrongInTfIsToldByHowMuch) {
  for (const double degrees : {90.0, -90.0, 30.0, -135.0}) {
    for (const bool hangs : {false, true}) {
      for (const double field : {2.0 * M_PI, 1.5 * M_PI}) {
        const LaserCheck check = Drive({DegreesToRadians(degrees), hangs, false, hangs, field});
        EXPECT_NEAR(Degrees(check), degrees, 8.0) << hangs << field;
      }
    }
  }
  EXPECT_NEAR(std::abs(Degrees(Drive({M_PI, false, false, false, 2.0 * M_PI}))), 180.0, 8.0);
}

TEST(LaserCheck, ALaserUpsideDownIsNotCalledTurned) {
  Laser laser;
  laser.hangs_unsaid = true;
  const LaserCheck check = Drive(laser);
  EXPECT_TRUE(check.IsUpsideDown());
  EXPECT_FALSE(check.Turned().has_value());
}

TEST(LaserCheck, ItsTurnsTellTheClocks) {
  for (const bool hangs : {false, true}) {
    for (const double late : {0.0, 0.3, -0.5}) {
      OdometryBuffer wheels;
      Laser laser;
      laser.hangs = hangs;
      laser.wiggle = 1.2;
      const LaserCheck check = Drive(laser, 40.0, late, &wheels);
      const std::optional<Deviation> offset = CompareTurns(check.turns(), wheels);
      ASSERT_TRUE(offset.has_value()) << late;
      EXPECT_NEAR(offset->value, -late, 0.04);
    }
  }
}

// Turns that are too fast for two sweeps to show them are left out; the rest is far from alike under no offset.
TEST(LaserCheck, FastTurnsTellTheClocksToo) {
  for (const double late : {0.0, 0.2, -0.2}) {
    OdometryBuffer wheels;
    Laser laser;
    laser.wiggle = 2.4;
    const LaserCheck check = Drive(laser, 40.0, late, &wheels);
    const std::optional<Deviation> offset = CompareTurns(check.turns(), wheels);
    ASSERT_TRUE(offset.has_value()) << late;
    EXPECT_NEAR(offset->value, -late, 0.02);
  }
}

TEST(LaserCheck, AFewStepsTellNothing) { EXPECT_FALSE(Drive({M_PI_2}, 2.0).Turned().has_value()); }

}  // namespace
}  // namespace planar_vslam
