#include "planar_vslam/pipeline/motion_comparison.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace planar_vslam {
namespace {

constexpr double kSeconds = 60.0;

// Where a robot is after t seconds that turns by `heading`.
std::function<Rigid2(double)> Drive(const std::function<double(double)>& heading) {
  return [heading](double t) { return Rigid2(0.3 * t, 0.0, heading(t)); };
}

// Bends that never come again the same: two periods without a common multiple in the drive.
double Winding(double t) { return 0.5 * std::sin(0.7 * t) + 0.4 * std::sin(1.13 * t + 0.1 * std::sin(0.31 * t)); }

MotionAgreement Compare(const std::function<Rigid2(double)>& drive, double wheels_are_late, double slip = 0.0) {
  std::mt19937 generator(7);
  std::normal_distribution<double> noise(0.0, 0.002);  // rad
  std::vector<SeenPose> seen;
  OdometryBuffer wheels;
  for (int i = 0; i < kSeconds * 50; ++i) {
    const double t = 0.02 * i;
    wheels.Push({Timestamp::FromSeconds(1000.0 + t + wheels_are_late), drive(t)});
    if (i % 5 != 0) continue;
    const double slipped = i % 35 == 0 ? slip : 0.0;
    seen.push_back({Timestamp::FromSeconds(1000.0 + t), drive(t) * Rigid2(0.0, 0.0, noise(generator) + slipped)});
  }
  return CompareMotions(seen, wheels);
}

TEST(CompareMotions, FindsTheClocksOffsetHoweverLarge) {
  for (const double late : {0.0, 0.08, -0.2, 0.5, -0.5, 1.0, -2.3, 4.4}) {
    const MotionAgreement agreement = Compare(Drive(Winding), late);
    ASSERT_TRUE(agreement.time_offset.has_value()) << late;
    EXPECT_NEAR(agreement.time_offset->value, late, 0.01);
    EXPECT_LT(agreement.time_offset->sigma, 0.01);
    ASSERT_TRUE(agreement.turn.has_value());
    EXPECT_NEAR(agreement.turn->value, 0.0, 0.02) << "compared at the same time";
  }
}

TEST(CompareMotions, TurnsThatRepeatThemselvesAreNoOffset) {
  const auto laps = Drive([](double t) { return 0.6 * std::sin(2.0 * t); });  // alike every 3.1 s
  for (const double slip : {0.0, 0.02}) {
    const MotionAgreement agreement = Compare(laps, 0.0, slip);
    ASSERT_TRUE(agreement.time_offset.has_value());
    EXPECT_NEAR(agreement.time_offset->value, 0.0, 0.01);
  }
}

TEST(CompareMotions, SaysNothingOfAStraightWay) {
  EXPECT_FALSE(Compare(Drive([](double) { return 0.3; }), 0.5).time_offset.has_value());
}

}  // namespace
}  // namespace planar_vslam
