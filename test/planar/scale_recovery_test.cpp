#include "planar_vslam/planar/scale_recovery.h"
#include "planar_vslam/planar/scale_estimate.h"

#include <gtest/gtest.h>

#include <random>

#include "support/support.h"

namespace planar_vslam::test {
namespace {

constexpr double kScale = 2.3;

struct Walk {
  int keyframes = 20;
  double visual_sigma = 0.0;    // m, on each camera position
  double odometry_sigma = 0.0;  // share of the step
  double lever = 0.1;           // m, camera ahead of the base
  bool head_turns = false;
  double slip_share = 0.0;  // of the steps, in which the wheels read 1.5 to 3 times the way
};

// Steps of 5-40 cm with a change of heading, every fifth one a turn on the spot. The visual map has its own
// orientation.
std::vector<LeverArmSample> Simulate(const Walk& walk, std::mt19937& generator) {
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  const Rigid3 T_map_world = RandomRigid3(generator, 3.0);
  Rigid2 T_world_base, T_odom_base;
  std::vector<LeverArmSample> samples;
  for (int k = 0; k < walk.keyframes; ++k) {
    const double head = walk.head_turns ? 0.8 * std::sin(0.7 * k) : 0.0;
    const Rigid3 T_base_camera(Eigen::Quaterniond(Eigen::AngleAxisd(head, Eigen::Vector3d::UnitZ())) *
                                   Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5),
                               Eigen::Vector3d(walk.lever * std::cos(head), walk.lever * std::sin(head), 0.9));
    Rigid3 T_map_camera = T_map_world * Embed3(T_world_base) * T_base_camera;
    for (int axis = 0; axis < 3; ++axis) T_map_camera.translation[axis] += walk.visual_sigma * normal(generator);
    T_map_camera.translation /= kScale;  // metric = scale * visual
    samples.push_back({T_map_camera, T_base_camera, T_odom_base});

    const double length = k % 5 == 4 ? 0.0 : 0.05 + 0.35 * uniform(generator);
    const double turn = k % 5 == 4 ? 0.5 : 0.3 * normal(generator);
    T_world_base = T_world_base * Rigid2(length, 0.0, turn);
    const double slip = uniform(generator) < walk.slip_share ? 1.5 + 1.5 * uniform(generator) : 1.0;
    T_odom_base = T_odom_base * Rigid2(length * slip * (1.0 + walk.odometry_sigma * normal(generator)), 0.0, turn);
  }
  return samples;
}

// The same instants with both positions those of the base.
std::vector<ScalePair> BasePairs(const std::vector<LeverArmSample>& samples) {
  std::vector<ScalePair> pairs;
  for (const LeverArmSample& sample : samples) {
    const Rigid3 T_map_base(sample.T_map_camera.rotation * sample.T_base_camera.rotation.conjugate(),
                            Eigen::Vector3d::Zero());
    const Eigen::Vector3d lever = T_map_base * sample.T_base_camera.translation;
    pairs.push_back({sample.T_map_camera.translation - lever / kScale, Embed3(sample.T_odom_base).translation});
  }
  return pairs;
}

TEST(ScaleRecovery, IsExactWithoutNoise) {
  std::mt19937 generator(1);
  for (int trial = 0; trial < 20; ++trial) {
    const std::vector<ScalePair> pairs = BasePairs(Simulate(Walk(), generator));
    EXPECT_NEAR(ScaleFromSteps(pairs).value(), kScale, 1e-9);
    EXPECT_NEAR(ScaleFromCentroids(pairs).value(), kScale, 1e-9);
  }
}

TEST(ScaleRecovery, MultipliesTheVisualMap) {
  // 1 m driven while the visual map says 2 units: halve the map.
  const std::vector<ScalePair> pairs = {{{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}, {{0.0, 0.0, 2.0}, {1.0, 0.0, 0.0}}};
  EXPECT_NEAR(ScaleFromSteps(pairs).value(), 0.5, 1e-12);
  EXPECT_NEAR(ScaleFromCentroids(pairs).value(), 0.5, 1e-12);
}

TEST(ScaleRecovery, IsExactWithALeverArmAndAMovingHead) {
  std::mt19937 generator(2);
  for (const bool head_turns : {false, true}) {
    Walk walk;
    walk.head_turns = head_turns;
    for (int trial = 0; trial < 20; ++trial) {
      const std::vector<LeverArmSample> samples = Simulate(walk, generator);
      for (const ScaleMethod method : {ScaleMethod::kSteps, ScaleMethod::kCentroids}) {
        EXPECT_NEAR(RecoverScale(samples, method, 0.5).value(), kScale, 1e-9);
      }
    }
  }
}

TEST(ScaleRecovery, IgnoringTheLeverArmIsWrong) {
  std::mt19937 generator(3);
  Walk walk;
  walk.lever = 0.3;
  double worst = 0.0;
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<ScalePair> pairs;
    for (const LeverArmSample& sample : Simulate(walk, generator)) {
      pairs.push_back({sample.T_map_camera.translation, Embed3(sample.T_odom_base).translation});
    }
    worst = std::max(worst, std::abs(ScaleFromSteps(pairs).value() / kScale - 1.0));
  }
  EXPECT_GT(worst, 0.02);
}

// Visual noise is part of every visual step: the ratio of steps comes out low however many keyframes there are.
TEST(ScaleRecovery, StepsAreBiasedByVisualNoiseAndCentroidsAreNot) {
  std::mt19937 generator(4);
  constexpr int kTrials = 200;
  for (const int keyframes : {20, 40}) {
    Walk walk;
    walk.keyframes = keyframes;
    walk.visual_sigma = 0.05;
    walk.odometry_sigma = 0.05;
    double steps = 0.0, centroids = 0.0;
    for (int trial = 0; trial < kTrials; ++trial) {
      const std::vector<LeverArmSample> samples = Simulate(walk, generator);
      steps += (RecoverScale(samples, ScaleMethod::kSteps, 0.5).value() / kScale - 1.0) / kTrials;
      centroids += (RecoverScale(samples, ScaleMethod::kCentroids, 0.5).value() / kScale - 1.0) / kTrials;
    }
    EXPECT_LT(steps, -0.08) << keyframes;
    EXPECT_LT(std::abs(centroids), 0.01) << keyframes;
  }
}

TEST(ScaleRecovery, SaysNothingOnTooLittleMotion) {
  std::mt19937 generator(5);
  const std::vector<LeverArmSample> samples = Simulate(Walk(), generator);
  const std::vector<LeverArmSample> standing(10, samples[0]);
  std::vector<LeverArmSample> turning;
  for (int k = 0; k < 10; ++k) {
    LeverArmSample sample = samples[0];
    sample.T_odom_base = Rigid2(0.0, 0.0, 0.2 * k);
    const Rigid3 T_map_base = Embed3(sample.T_odom_base);
    sample.T_map_camera = T_map_base * sample.T_base_camera;
    turning.push_back(sample);
  }
  for (const ScaleMethod method : {ScaleMethod::kSteps, ScaleMethod::kCentroids}) {
    EXPECT_FALSE(RecoverScale({}, method, 0.0));
    EXPECT_FALSE(RecoverScale({samples[0], samples[1]}, method, 0.0));
    EXPECT_FALSE(RecoverScale(samples, method, 1000.0));
    EXPECT_FALSE(RecoverScale(standing, method, 0.0));
    EXPECT_FALSE(RecoverScale(turning, method, 0.0));
  }
}

// Turning to and fro while creeping ahead.
TEST(ScaleRecovery, SaysNothingWhereTheLeverArmSwingsMoreThanTheBase) {
  const Rigid3 T_base_camera(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.3, 0.0, 0.9));
  std::vector<LeverArmSample> samples;
  for (int k = 0; k < 20; ++k) {
    const double angle = k % 2 == 0 ? 0.3 : -0.3;
    const Rigid2 T_odom_base(0.01 * k, 0.0, angle);
    Rigid3 T_map_camera = Embed3(T_odom_base) * T_base_camera;
    T_map_camera.translation /= kScale;
    samples.push_back({T_map_camera, T_base_camera, T_odom_base});
  }
  EXPECT_FALSE(RecoverScale(samples, ScaleMethod::kSteps, 0.1));
}

TEST(ScaleRecovery, SaysNothingWhereOneTrackStandsStill) {
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero(), one = Eigen::Vector3d::UnitX();
  for (const std::vector<ScalePair>& pairs :
       {std::vector<ScalePair>{}, {{one, one}}, {{zero, zero}, {one, zero}}, {{zero, zero}, {zero, one}}}) {
    EXPECT_FALSE(ScaleFromSteps(pairs));
    EXPECT_FALSE(ScaleFromCentroids(pairs));
  }
}

// Tracking in an up-to-scale map mixes the camera's unscaled motion with the metric lever arms: scaling one camera's
// motion between keyframes gives the base motion that was really driven.
TEST(ScaleCameraMotion, RestoresTheBaseMotion) {
  std::mt19937 generator(6);
  for (int trial = 0; trial < 20; ++trial) {
    const Rigid3 T_refbase_camera = RandomRigid3(generator, 0.5), T_base_camera = RandomRigid3(generator, 0.5);
    const Rigid3 T_ref_base = RandomRigid3(generator, 2.0);
    Rigid3 T_refcamera_camera = T_refbase_camera.Inverse() * T_ref_base * T_base_camera;
    T_refcamera_camera.translation /= kScale;
    const Rigid3 unscaled = T_refbase_camera * T_refcamera_camera * T_base_camera.Inverse();
    const Rigid3 scaled = ScaleCameraMotion(unscaled, T_refbase_camera, T_base_camera, kScale);
    EXPECT_LT((T_ref_base.translation - scaled.translation).norm(), 1e-12);
    EXPECT_LT(T_ref_base.rotation.angularDistance(scaled.rotation), 1e-7);
  }
}

struct EstimateErrors {
  double bias = 0.0, rms = 0.0, stated = 0.0, slipped = 0.0;  // of log(scale); sigma as stated, rms; slips a track
};

EstimateErrors ErrorsOver(const Walk& walk, int trials) {
  std::mt19937 generator(11);
  EstimateErrors errors;
  for (int trial = 0; trial < trials; ++trial) {
    const std::optional<ScaleEstimate> estimate = EstimateScale(Simulate(walk, generator));
    EXPECT_TRUE(estimate.has_value());
    if (!estimate.has_value()) continue;
    const double error = std::log(estimate->scale / kScale);
    errors.bias += error / trials;
    errors.rms += error * error / trials;
    errors.stated += estimate->sigma * estimate->sigma / trials;
    errors.slipped += static_cast<double>(estimate->slipped) / trials;
  }
  errors.rms = std::sqrt(errors.rms);
  errors.stated = std::sqrt(errors.stated);
  return errors;
}

TEST(EstimateScale, KnowsHowGoodItIs) {
  for (const int keyframes : {20, 40, 100}) {
    Walk walk;
    walk.keyframes = keyframes;
    walk.visual_sigma = 0.01;
    walk.odometry_sigma = 0.05;
    const EstimateErrors errors = ErrorsOver(walk, 300);
    EXPECT_LT(std::abs(errors.bias), 0.005) << keyframes;
    EXPECT_GT(errors.stated, 0.7 * errors.rms) << keyframes;
    EXPECT_LT(errors.stated, 1.4 * errors.rms) << keyframes;
  }
}

TEST(EstimateScale, CutsSlipsOut) {
  Walk walk;
  walk.keyframes = 40;
  walk.visual_sigma = 0.005;
  walk.odometry_sigma = 0.02;
  walk.slip_share = 0.1;
  const EstimateErrors errors = ErrorsOver(walk, 300);
  EXPECT_LT(std::abs(errors.bias), 0.01);
  EXPECT_LT(errors.rms, 0.02);
  EXPECT_GT(errors.slipped, 2.0);
  EXPECT_LT(errors.slipped, 6.0);
}

TEST(EstimateScale, SaysNothingWithoutMotion) {
  EXPECT_FALSE(EstimateScale({}).has_value());
  const LeverArmSample still{Rigid3(), Rigid3(), Rigid2()};
  EXPECT_FALSE(EstimateScale({still, still, still, still}).has_value());
}

TEST(FuseScale, WeighsByVariance) {
  EXPECT_FALSE(Fuse({}).has_value());
  const std::optional<ScaleMeasurement> both = Fuse({{0.02, 0.01}, {0.0, 0.005}});
  ASSERT_TRUE(both.has_value());
  EXPECT_NEAR(both->log_scale, 0.004, 1e-12);
  EXPECT_NEAR(both->sigma, 0.01 / std::sqrt(5.0), 1e-12);
}

}  // namespace
}  // namespace planar_vslam::test
