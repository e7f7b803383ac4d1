#include "planar_vslam/planar/floor_monitor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "planar_vslam/geometry/chi_square.h"
#include "support/support.h"

namespace planar_vslam {
namespace {

constexpr double kSigmaHeight = 0.01;                 // m
constexpr double kSigmaTilt = DegreesToRadians(0.5);  // rad
Timestamp StampAt(double way) { return Timestamp::FromSeconds(10.0 * way); }
// A pose `way` metres along x, this high and rolled, estimated without error.
FloorReading At(double way, double height, double roll = 0.0) {
  const Rigid3 pose(ExpSo3(Eigen::Vector3d(roll, 0.0, 0.0)), Eigen::Vector3d(way, 0.0, height));
  return ReadFloor(StampAt(way), pose, Matrix6d::Zero(), kSigmaHeight, kSigmaTilt);
}

TEST(FloorMonitor, ReleasesOnARampWithinItsFirstMetre) {
  FloorMonitor monitor;
  for (double way = 0.0; way < 3.0; way += 0.1) monitor.Add(At(way, 0.0));
  EXPECT_TRUE(monitor.on_floor());
  double way = 3.0;
  for (; monitor.on_floor() && way < 6.0; way += 0.1) {
    monitor.Add(At(way, (way - 3.0) * std::tan(DegreesToRadians(5.0)), DegreesToRadians(5.0)));
  }
  EXPECT_LT(way, 4.0);
}

TEST(FloorMonitor, ReleasesFromTheFootOfTheRampOn) {
  FloorMonitor monitor;
  std::optional<Timestamp> since;
  for (double way = 0.0; way < 6.0 && !since.has_value(); way += 0.1) {
    const double climbed = std::max(0.0, way - 3.0) * std::tan(DegreesToRadians(5.0));
    since = monitor.Add(At(way, climbed, climbed > 0.0 ? DegreesToRadians(5.0) : 0.0));
    EXPECT_EQ(since.has_value(), !monitor.on_floor());
  }
  ASSERT_TRUE(since.has_value());
  EXPECT_LE(*since, StampAt(3.05));
  EXPECT_GE(*since, StampAt(1.95));
}

TEST(FloorMonitor, StaysWhereAMapBendsSlowly) {
  FloorMonitor monitor;
  for (double way = 0.0; way < 20.0; way += 0.1) monitor.Add(At(way, 0.004 * way, DegreesToRadians(0.1) * way));
  EXPECT_TRUE(monitor.on_floor());
}

TEST(FloorMonitor, ReleasesOnAStreetThatKeepsClimbing) {
  FloorMonitor monitor;
  for (double way = 0.0; way < 60.0; way += 0.5) monitor.Add(At(way, 0.01 * way));
  EXPECT_FALSE(monitor.on_floor());
}

TEST(FloorMonitor, OneOrTwoOddPosesAreNoRamp) {
  FloorMonitor monitor;
  for (int i = 0; i < 100; ++i) monitor.Add(At(0.1 * i, i % 20 < 2 ? 0.15 : 0.0));
  EXPECT_TRUE(monitor.on_floor());
}

TEST(FloorMonitor, ComesBackAfterFiveInARowOnTheFloor) {
  FloorMonitor monitor;
  for (int i = 0; i < 5; ++i) monitor.Add(At(0.1 * i, i > 0 ? 0.5 : 0.0));
  ASSERT_FALSE(monitor.on_floor());
  for (int i = 0; i < 4; ++i) monitor.Add(At(1.0 + 0.1 * i, 0.01));
  monitor.Add(At(2.0, 0.5));  // breaks the row
  for (int i = 0; i < 4; ++i) monitor.Add(At(2.1 + 0.1 * i, 0.01));
  EXPECT_FALSE(monitor.on_floor());
  monitor.Add(At(3.0, 0.01));
  EXPECT_TRUE(monitor.on_floor());
}

// A metre up a ramp and down again, then level on a map that lost height by the way.
FloorMonitor AfterRamp(double* way) {
  FloorMonitor monitor;
  for (*way = 0.0; *way < 4.0; *way += 0.1) {
    const double slope = *way < 2.0 ? 0.0 : *way < 3.0 ? 1.0 : -1.0;
    const double height = std::max(0.0, 1.0 - std::abs(*way - 3.0)) * std::tan(DegreesToRadians(5.0));
    monitor.Add(At(*way, height, slope * DegreesToRadians(5.0)));
  }
  return monitor;
}

TEST(FloorMonitor, ComesBackThoughTheMapHasLostHeightOverTheRamp) {
  double way = 0.0;
  FloorMonitor monitor = AfterRamp(&way);
  ASSERT_FALSE(monitor.on_floor());
  for (int i = 0; i < 5; ++i) monitor.Add(At(way += 0.1, -0.04, DegreesToRadians(-0.4)));
  EXPECT_TRUE(monitor.on_floor());
}

TEST(FloorMonitor, StaysOffOnALevelThatALongRampLedTo) {
  FloorMonitor monitor;
  for (double way = 0.0; way < 40.0; way += 0.1) {
    const bool on_ramp = way > 2.0 && way < 22.0;
    const double climbed = std::clamp(way - 2.0, 0.0, 20.0) * std::tan(DegreesToRadians(2.0));
    monitor.Add(At(way, climbed, on_ramp ? DegreesToRadians(2.0) : 0.0));
  }
  EXPECT_FALSE(monitor.on_floor());
}

TEST(FloorMonitor, StaysOffOnAnotherLevel) {
  FloorMonitor monitor;
  for (double way = 0.0; way < 5.0; way += 0.1) {
    const double climbed = std::clamp(way - 2.0, 0.0, 1.0) * std::tan(DegreesToRadians(5.0));
    monitor.Add(At(way, climbed, way > 2.0 && way < 3.0 ? DegreesToRadians(5.0) : 0.0));
  }
  EXPECT_FALSE(monitor.on_floor());
}

TEST(FloorReading, IsZeroForAnyPoseOnTheFloor) {
  std::mt19937 generator(5);
  for (int i = 0; i < 20; ++i) {
    const Rigid3 pose = Embed3(test::RandomRigid2(generator, 5.0));
    EXPECT_NEAR(ReadFloor({}, pose, 1e-4 * Matrix6d::Identity(), kSigmaHeight, kSigmaTilt).SquaredDistance(), 0.0,
                1e-9);
  }
}

TEST(FloorReading, CountsHeightInSigmas) {
  const Rigid3 raised(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1.0, 2.0, 3.0 * kSigmaHeight));
  EXPECT_NEAR(ReadFloor({}, raised, Matrix6d::Zero(), kSigmaHeight, kSigmaTilt).SquaredDistance(), 9.0, 1e-9);
  const Matrix6d unsure = Matrix6d::Identity() * 8.0 * kSigmaHeight * kSigmaHeight;
  EXPECT_NEAR(ReadFloor({}, raised, unsure, kSigmaHeight, kSigmaTilt).SquaredDistance(), 1.0, 1e-9);
}

// Poses on a floor as rough as the sigmas say, estimated with a known covariance: d^2 is chi-square with 3 dof.
TEST(FloorReading, IsChiSquareOnTheFloor) {
  std::mt19937 generator(6);
  std::normal_distribution<double> normal;
  Matrix6d root = Matrix6d::Zero();
  root.diagonal() << 0.02, 0.01, 0.008, 0.004, 0.006, 0.01;
  root(2, 0) = 0.005;
  root(3, 2) = -0.003;
  const Matrix6d covariance = root * root.transpose();
  constexpr int kSamples = 4000;
  double sum = 0.0;
  int beyond = 0;
  for (int i = 0; i < kSamples; ++i) {
    const Rigid3 flat = Embed3(test::RandomRigid2(generator, 3.0));
    const Eigen::Vector3d tilt(kSigmaTilt * normal(generator), kSigmaTilt * normal(generator), 0.0);
    Rigid3 truth = flat * Rigid3(ExpSo3(tilt), Eigen::Vector3d::Zero());
    truth.translation.z() += kSigmaHeight * normal(generator);
    Vector6d sample;
    for (int k = 0; k < 6; ++k) sample[k] = normal(generator);
    const double d =
        ReadFloor({}, truth * ExpSe3(root * sample), covariance, kSigmaHeight, kSigmaTilt).SquaredDistance();
    sum += d;
    beyond += d > kChi2ThreeDof90 ? 1 : 0;
  }
  EXPECT_NEAR(sum / kSamples, 3.0, 0.15);  // three sigmas of the mean are 0.12
  EXPECT_NEAR(static_cast<double>(beyond) / kSamples, 0.1, 0.02);
}

}  // namespace
}  // namespace planar_vslam
