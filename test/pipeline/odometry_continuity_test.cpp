#include "planar_vslam/pipeline/odometry_continuity.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <random>

namespace planar_vslam {
namespace {

constexpr double kPeriod = 0.02;  // s

Timestamp At(int k) { return Timestamp::FromSeconds(kPeriod * k); }
// A curve at 0.5 m/s, far from the origin.
Rigid2 PoseAt(int k) { return Rigid2(450.0, -60.0, 2.0) * ExpSe2(Eigen::Vector3d(0.5, 0.0, 0.6) * kPeriod * k); }

std::vector<OdometryReading> Through(OdometryContinuity* continuity, const std::vector<OdometryReading>& readings) {
  std::vector<OdometryReading> settled;
  for (const OdometryReading& reading : readings) {
    if (const auto out = continuity->Push(reading)) settled.push_back(*out);
  }
  return settled;
}

std::vector<OdometryReading> Drive(int count) {
  std::vector<OdometryReading> readings;
  for (int k = 0; k < count; ++k) readings.push_back({At(k), PoseAt(k)});
  return readings;
}

double DistanceBetween(const Rigid2& a, const Rigid2& b) {
  const Rigid2 difference = a.Inverse() * b;
  return difference.translation.norm() + std::abs(difference.angle);
}

TEST(OdometryContinuity, ADriveStaysAsItIs) {
  OdometryContinuity continuity;
  const std::vector<OdometryReading> readings = Drive(100), settled = Through(&continuity, readings);
  ASSERT_EQ(settled.size(), readings.size());
  for (std::size_t k = 0; k < readings.size(); ++k) {
    EXPECT_EQ(settled[k].stamp, readings[k].stamp);
    EXPECT_EQ(settled[k].T_odom_base.translation, readings[k].T_odom_base.translation);
  }
  EXPECT_TRUE(continuity.counted().empty());
}

TEST(OdometryContinuity, JumpsAreBridgedWithTheMotionBefore) {
  // A base that restarts, a filter that is corrected, a single message that is off, and one that is far off.
  const std::function<Rigid2(int)> faults[] = {
      [](int k) { return k < 50 ? PoseAt(k) : PoseAt(50).Inverse() * PoseAt(k); },
      [](int k) { return k < 50 ? PoseAt(k) : Rigid2(3.0, 1.0, 0.7) * PoseAt(k); },
      [](int k) { return k == 50 ? PoseAt(k) * Rigid2(3.0, 0.0, 0.0) : PoseAt(k); },
      [](int k) { return k == 50 ? Rigid2(1e30, 0.0, 0.0) : PoseAt(k); }};
  for (const auto& fault : faults) {
    std::vector<OdometryReading> readings = Drive(100);
    for (int k = 0; k < 100; ++k) readings[static_cast<std::size_t>(k)].T_odom_base = fault(k);
    OdometryContinuity continuity;
    const std::vector<OdometryReading> settled = Through(&continuity, readings);
    ASSERT_GE(settled.size(), 99U);
    const Rigid2 driven = settled.front().T_odom_base.Inverse() * settled.back().T_odom_base;
    EXPECT_LT(DistanceBetween(driven, PoseAt(0).Inverse() * PoseAt(99)), 1e-6);
    EXPECT_FALSE(continuity.counted().empty());
  }
}

TEST(OdometryContinuity, GarbageAtTheStartIsWorthless) {
  std::vector<OdometryReading> readings = Drive(100);
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> anywhere(-4e5, 4e5);
  for (std::size_t k = 0; k < 25; ++k) readings[k].T_odom_base = Rigid2(anywhere(generator), anywhere(generator), 0.0);
  OdometryContinuity continuity;
  const std::vector<OdometryReading> settled = Through(&continuity, readings);
  EXPECT_TRUE(continuity.TakeWorthlessStart());
  EXPECT_FALSE(continuity.TakeWorthlessStart()) << "once";
  EXPECT_EQ(continuity.counted().at("odometry that jumped"), 25);
  const Rigid2 driven = settled[25].T_odom_base.Inverse() * settled.back().T_odom_base;
  EXPECT_LT(DistanceBetween(driven, PoseAt(25).Inverse() * PoseAt(99)), 1e-6) << "and good from then on";
}

TEST(OdometryContinuity, APoseThatStoodStillAndJumpsIntoMotionWasNone) {
  const auto worthless = [](double speed) {
    OdometryContinuity continuity;
    bool found = false;
    for (int k = 0; k < 50; ++k) {
      const Rigid2 T = k < 25 ? Rigid2(1.3e5, -4.2e5, 2.0) : Rigid2(speed * kPeriod * k, 0.0, 0.0);
      continuity.Push({At(k), T});
      found = continuity.TakeWorthlessStart() || found;
    }
    EXPECT_EQ(continuity.counted().at("odometry that jumped"), 1);
    return found;
  };
  EXPECT_TRUE(worthless(0.4));
  EXPECT_FALSE(worthless(0.0)) << "a robot that stands may be restarted";
}

TEST(OdometryContinuity, StampsInBurstsAreNoJumps) {
  OdometryContinuity continuity;
  std::vector<OdometryReading> readings;
  for (int k = 0; k < 50; ++k) {
    const double t = 0.1 * k - (k % 3 == 2 ? 0.099 : 0.0);
    readings.push_back({Timestamp::FromSeconds(t), Rigid2(0.08 * k, 0.0, 0.02 * k)});
  }
  EXPECT_EQ(Through(&continuity, readings).size(), readings.size());
  EXPECT_TRUE(continuity.counted().empty());
}

TEST(OdometryContinuity, FastRobotsAndLongGapsAreNoJumps) {
  for (const double speed : {0.1, 3.0, 35.0}) {
    OdometryContinuity continuity;
    std::vector<OdometryReading> readings;
    for (int k = 0; k < 50; ++k) {
      const double t = kPeriod * k + (k > 25 ? 3.0 : 0.0);
      readings.push_back({Timestamp::FromSeconds(t), Rigid2(speed * t, 0.0, 0.0)});
    }
    EXPECT_EQ(Through(&continuity, readings).size(), readings.size());
    EXPECT_TRUE(continuity.counted().empty()) << speed;
  }
}

TEST(OdometryContinuity, WhatIsNoNumberIsDropped) {
  std::vector<OdometryReading> readings = Drive(10);
  readings[0].T_odom_base.angle = readings[5].T_odom_base.angle = std::numeric_limits<double>::quiet_NaN();
  OdometryContinuity continuity;
  EXPECT_EQ(Through(&continuity, readings).size(), 8U);
  EXPECT_EQ(continuity.counted().at("odometry not finite"), 2);
}

}  // namespace
}  // namespace planar_vslam
