#include "planar_vslam/planar/odometry_calibration.h"

#include <gtest/gtest.h>

#include <cmath>

#include "factor_testing.h"
#include "planar_vslam/planar/preintegration.h"
#include "planar_vslam/planar/relative_pose_factor.h"

namespace planar_vslam::test {
namespace {

constexpr double kPeriod = 0.02;  // s between readings

Timestamp At(double seconds) { return Timestamp::FromSeconds(100.0 + seconds); }

// Smoothly changing velocity: forward, sideways and turning, across yaw = pi. `read` scales what the wheels say.
Eigen::Vector3d TwistAt(double t) {
  return {0.4 + 0.2 * std::sin(1.3 * t), 0.1 * std::sin(0.7 * t), 0.5 * std::sin(0.9 * t) + 0.2};
}
std::vector<OdometryReading> Readings(double seconds, const Eigen::Vector3d& read = Eigen::Vector3d::Ones()) {
  std::vector<OdometryReading> readings;
  Rigid2 T_odom_base(1.0, -2.0, 3.0);
  for (int k = 0; k * kPeriod <= seconds; ++k) {
    readings.push_back({At(k * kPeriod), T_odom_base});
    T_odom_base = T_odom_base * ExpSe2(kPeriod * read.cwiseProduct(TwistAt((k + 0.5) * kPeriod)));
  }
  return readings;
}

Matrix6d AnyWeight() {
  std::mt19937 generator(3);
  Matrix6d weight = 5.0 * Matrix6d::Identity();
  for (int k = 0; k < 6; ++k) weight.row(k) += 0.5 * RandomTangent(generator, 1.0).transpose();
  return weight;
}

// The motion from numeric differences against the derivatives it reports.
TEST(CorrectMotion, DerivativesAreThoseOfTheMotion) {
  const std::vector<OdometryReading> readings = Readings(4.0);
  const OdometryCorrection correction{{1.03, 0.96, 0.98}, 0.033};
  const CorrectedMotion motion = CorrectMotion(readings, At(0.505), At(2.513), correction);
  for (int k = 0; k < 3; ++k) {
    constexpr double kStep = 1e-6;
    OdometryCorrection more = correction, less = correction;
    more.scale[k] += kStep;
    less.scale[k] -= kStep;
    const Eigen::Vector3d difference = LogSe2(CorrectMotion(readings, At(0.505), At(2.513), less).T_i_j.Inverse() *
                                              CorrectMotion(readings, At(0.505), At(2.513), more).T_i_j) /
                                       (2.0 * kStep);
    EXPECT_LT((difference - motion.by_scale.col(k)).norm(), 1e-6) << k;
  }
  constexpr double kStep = 1e-6;  // s
  OdometryCorrection more = correction, less = correction;
  more.time_offset += kStep;
  less.time_offset -= kStep;
  const Eigen::Vector3d difference = LogSe2(CorrectMotion(readings, At(0.505), At(2.513), less).T_i_j.Inverse() *
                                            CorrectMotion(readings, At(0.505), At(2.513), more).T_i_j) /
                                     (2.0 * kStep);
  EXPECT_LT((difference - motion.by_time_offset).norm(), 1e-6);
}

TEST(CorrectMotion, WithoutCorrectionItIsTheDifferenceOfTheEnds) {
  const std::vector<OdometryReading> readings = Readings(3.0);
  const CorrectedMotion motion = CorrectMotion(readings, readings[10].stamp, readings[90].stamp, {});
  const Rigid2 expected = readings[10].T_odom_base.Inverse() * readings[90].T_odom_base;
  EXPECT_LT(LogSe2(expected.Inverse() * motion.T_i_j).norm(), 1e-9);
}

TEST(CorrectMotion, UndoesTheScaleOfTheWheelsAndTheDelay) {
  const Eigen::Vector3d read(1.02, 0.95, 1.03);
  std::vector<OdometryReading> wrong = Readings(3.0, read);
  for (OdometryReading& reading : wrong) reading.stamp = Timestamp{reading.stamp.nanoseconds + 80'000'000};
  const CorrectedMotion motion = CorrectMotion(wrong, At(0.4), At(2.0), {read.cwiseInverse(), 0.08});
  const CorrectedMotion truth = CorrectMotion(Readings(3.0), At(0.4), At(2.0), {});
  EXPECT_LT(LogSe2(truth.T_i_j.Inverse() * motion.T_i_j).norm(), 1e-6);
}

TEST(OdometryCorrector, GivesWhatTheFactorPredicts) {
  const std::vector<OdometryReading> readings = Readings(3.0);
  const OdometryCorrection correction{{1.02, 0.97, 1.01}, -0.04};
  OdometryCorrector corrector(correction);
  std::vector<OdometryReading> corrected;
  for (const OdometryReading& reading : readings) corrected.push_back(corrector.Correct(reading));
  const CorrectedMotion predicted = CorrectMotion(readings, At(0.5), At(2.5), correction);
  const CorrectedMotion found = CorrectMotion(corrected, At(0.5), At(2.5), {});
  EXPECT_LT(LogSe2(predicted.T_i_j.Inverse() * found.T_i_j).norm(), 1e-6);
}

TEST(OdometryCorrector, ScalesWhatMessagesSayOfTheError) {
  OdometryCorrector scaled({{2.0, 1.0, 3.0}, 0.0}), plain({});
  OdometryReading reading = Readings(0.5)[1];
  reading.covariance_rate = Eigen::Matrix3d::Ones();
  EXPECT_EQ(*plain.Correct(reading).covariance_rate, Eigen::Matrix3d::Ones());
  Eigen::Matrix3d expected;
  expected << 4.0, 2.0, 6.0, 2.0, 1.0, 3.0, 6.0, 3.0, 9.0;
  EXPECT_EQ(*scaled.Correct(reading).covariance_rate, expected);
}

TEST(OdometryCorrector, GoesOnFromWhereItIsWhenTheScaleChanges) {
  OdometryCorrector corrector({});
  const std::vector<OdometryReading> readings = Readings(3.0);
  Rigid2 last;
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const std::size_t third = 3 * k / readings.size();
    const double scale = third == 1 ? 1.1 : 1.0;
    corrector.SetScale({scale, scale, scale});
    const Rigid2 T_odom_base = corrector.Correct(readings[k]).T_odom_base;
    if (k > 0) {
      const Eigen::Vector3d read = LogSe2(readings[k - 1].T_odom_base.Inverse() * readings[k].T_odom_base);
      EXPECT_LT((LogSe2(last.Inverse() * T_odom_base) - scale * read).norm(), 1e-9) << k;
    }
    last = T_odom_base;
  }
}

TEST(OdometryCorrector, WithoutCorrectionChangesNoBit) {
  OdometryCorrector corrector({});
  for (const OdometryReading& reading : Readings(0.5)) {
    const OdometryReading same = corrector.Correct(reading);
    EXPECT_EQ(same.stamp, reading.stamp);
    EXPECT_EQ(same.T_odom_base.translation, reading.T_odom_base.translation);
    EXPECT_EQ(same.T_odom_base.angle, reading.T_odom_base.angle);
  }
}

// Gradients of a factor on two poses and further plain blocks, by the checker.
void ExpectAllGradientsRight(const ceres::CostFunction& cost, const std::vector<Block>& blocks, double tolerance) {
  const PoseManifold pose;
  std::vector<ceres::EuclideanManifold<ceres::DYNAMIC>> plain;
  plain.reserve(blocks.size());
  std::vector<const ceres::Manifold*> manifolds;
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    plain.emplace_back(static_cast<int>(blocks[k].size()));
    manifolds.push_back(k < 2 ? static_cast<const ceres::Manifold*>(&pose) : &plain.back());
  }
  ceres::NumericDiffOptions numeric;
  numeric.ridders_relative_initial_step_size = 1e-3;
  const ceres::GradientChecker checker(&cost, &manifolds, numeric);
  std::vector<const double*> parameters;
  for (const Block& block : blocks) parameters.push_back(block.data());
  ceres::GradientChecker::ProbeResults results;
  checker.Probe(parameters.data(), 1.0, &results);
  ASSERT_TRUE(results.return_value);
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    const double error = (results.local_jacobians[k] - results.local_numeric_jacobians[k]).norm();
    EXPECT_LT(error, tolerance * (1.0 + results.local_numeric_jacobians[k].norm()))
        << "block " << k << "\n"
        << results.local_jacobians[k] << "\nnumeric\n"
        << results.local_numeric_jacobians[k];
  }
}

TEST(OdometryCalibrationFactor, GradientsAreRightAndTruthIsZero) {
  const std::vector<OdometryReading> readings = Readings(3.0);
  const OdometryCorrection correction{{1.02, 0.97, 1.01}, 0.0301};
  const Rigid3 T_i_j = Embed3(CorrectMotion(readings, At(0.4999), At(1.5199), correction).T_i_j);
  const OdometryCalibrationFactor factor(readings, At(0.4999), At(1.5199), AnyWeight());
  std::mt19937 generator(4);
  for (const Rigid3& T_map_i : NastyPoses()) {
    const Rigid3 T_map_j = T_map_i * T_i_j;
    const Block scale{1.02, 0.97, 1.01}, offset{0.0301};
    const Block truth_i = ToBlock(T_map_i), truth_j = ToBlock(T_map_j);
    const double* parameters[] = {truth_i.data(), truth_j.data(), scale.data(), offset.data()};
    Vector6d residual;
    ASSERT_TRUE(factor.Evaluate(parameters, residual.data(), nullptr));
    EXPECT_LT(residual.norm(), 1e-9);
    const Rigid3 moved = T_map_j * ExpSe3(RandomTangent(generator, 0.2));
    ExpectAllGradientsRight(factor, {truth_i, ToBlock(moved), scale, offset}, 1e-6);
  }
}

TEST(DelayedMotionFactor, GradientsAreRightAndTruthIsZero) {
  const std::vector<OdometryReading> readings = Readings(3.0);
  constexpr double kPresent = 0.01, kOffset = 0.0301;
  // The other sensor is right about odometry's clock; the images were taken later than was thought.
  const Rigid2 T_thought = CorrectMotion(readings, At(0.4999), At(1.5199), {Eigen::Vector3d::Ones(), kPresent}).T_i_j;
  const Rigid2 T_truth = CorrectMotion(readings, At(0.4999), At(1.5199), {Eigen::Vector3d::Ones(), kOffset}).T_i_j;
  const DelayedMotionFactor factor(T_thought, {readings, At(0.4999)}, {readings, At(1.5199)}, kPresent, AnyWeight());
  std::mt19937 generator(5);
  for (const Rigid3& T_map_i : NastyPoses()) {
    const Block truth_i = ToBlock(T_map_i), truth_j = ToBlock(T_map_i * Embed3(T_truth)), offset{kOffset};
    const double* parameters[] = {truth_i.data(), truth_j.data(), offset.data()};
    Vector6d residual;
    ASSERT_TRUE(factor.Evaluate(parameters, residual.data(), nullptr));
    EXPECT_LT(residual.norm(), 1e-8);
    const Rigid3 moved = T_map_i * Embed3(T_truth) * ExpSe3(RandomTangent(generator, 0.2));
    ExpectAllGradientsRight(factor, {truth_i, ToBlock(moved), offset}, 1e-6);
  }
}

}  // namespace
}  // namespace planar_vslam::test
