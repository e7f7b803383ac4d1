#include "planar_vslam/planar/floor_monitor.h"

#include <gtest/gtest.h>

#include <random>

#include "support/support.h"

namespace planar_vslam {
namespace {

constexpr double kSigmaHeight = 0.01;                         // m
constexpr double kSigmaTilt = DegreesToRadians(0.5);          // rad
constexpr double kFar = 100.0, kNear = 1.0, kBetween = 10.0;  // squared distances: beyond 99.9 %, within 90 %, neither

TEST(FloorMonitor, ReleasesAfterThreeInARow) {
  FloorMonitor monitor;
  EXPECT_TRUE(monitor.on_floor());
  for (int i = 0; i < 5; ++i) {
    monitor.Add(kFar);
    monitor.Add(kFar);
    monitor.Add(kBetween);  // breaks the row
  }
  EXPECT_TRUE(monitor.on_floor());
  monitor.Add(kFar);
  monitor.Add(kFar);
  EXPECT_TRUE(monitor.on_floor());
  monitor.Add(kFar);
  EXPECT_FALSE(monitor.on_floor());
}

TEST(FloorMonitor, ComesBackAfterTenInARowWithinTheNarrowerLimit) {
  FloorMonitor monitor;
  for (int i = 0; i < 3; ++i) monitor.Add(kFar);
  ASSERT_FALSE(monitor.on_floor());
  for (int i = 0; i < 9; ++i) monitor.Add(kNear);
  monitor.Add(kBetween);
  for (int i = 0; i < 9; ++i) monitor.Add(kNear);
  EXPECT_FALSE(monitor.on_floor());
  monitor.Add(kNear);
  EXPECT_TRUE(monitor.on_floor());
}

TEST(FloorDistance, IsZeroForAnyPoseOnTheFloor) {
  std::mt19937 generator(5);
  for (int i = 0; i < 20; ++i) {
    const Rigid3 pose = Embed3(test::RandomRigid2(generator, 5.0));
    EXPECT_NEAR(FloorDistance(pose, 1e-4 * Matrix6d::Identity(), kSigmaHeight, kSigmaTilt), 0.0, 1e-9);
  }
}

TEST(FloorDistance, CountsHeightInSigmas) {
  const Rigid3 raised(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1.0, 2.0, 3.0 * kSigmaHeight));
  EXPECT_NEAR(FloorDistance(raised, Matrix6d::Zero(), kSigmaHeight, kSigmaTilt), 9.0, 1e-9);
  const Matrix6d unsure = Matrix6d::Identity() * 8.0 * kSigmaHeight * kSigmaHeight;
  EXPECT_NEAR(FloorDistance(raised, unsure, kSigmaHeight, kSigmaTilt), 1.0, 1e-9);
}

// Poses on a floor as rough as the sigmas say, estimated with a known covariance: d^2 is chi-square with 3 dof.
TEST(FloorDistance, IsChiSquareOnTheFloor) {
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
    const double d = FloorDistance(truth * ExpSe3(root * sample), covariance, kSigmaHeight, kSigmaTilt);
    sum += d;
    beyond += d > 6.251 ? 1 : 0;  // chi-square, 3 dof, 90 %
  }
  EXPECT_NEAR(sum / kSamples, 3.0, 0.15);  // three sigmas of the mean are 0.12
  EXPECT_NEAR(static_cast<double>(beyond) / kSamples, 0.1, 0.02);
}

}  // namespace
}  // namespace planar_vslam
