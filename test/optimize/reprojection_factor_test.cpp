#include "planar_vslam/optimize/reprojection_factor.h"

#include <ceres/gradient_checker.h>
#include <gtest/gtest.h>

#include "planar_vslam/planar/pose_manifold.h"
#include "support/factor_twins.h"
#include "support/support.h"

namespace planar_vslam {
namespace {

constexpr double kF = 600.0, kCx = 320.0, kCy = 240.0, kSigma = 1.3;

struct Case {
  Rigid3 T_map_base, T_base_camera;
  Eigen::Vector3d p_map;
  Eigen::Vector2d pixel;  // where the point is seen
};

Case RandomCase(std::mt19937& generator, double yaw_override) {
  Case c;
  c.T_map_base = test::RandomRigid3(generator, 5.0);
  if (std::isfinite(yaw_override)) c.T_map_base = Embed3(Rigid2(1.0, -2.0, yaw_override));
  c.T_base_camera = test::RandomRigid3(generator, 1.0);
  std::uniform_real_distribution<double> side(-1.0, 1.0), depth(1.0, 6.0);
  const double z = depth(generator);
  const Eigen::Vector3d p_camera(side(generator) * 0.4 * z, side(generator) * 0.3 * z, z);
  c.p_map = c.T_map_base * c.T_base_camera * p_camera;
  c.pixel = {kF * p_camera.x() / z + kCx, kF * p_camera.y() / z + kCy};
  return c;
}

ReprojectionFactor MakeFactor(const Case& c, const Eigen::Vector2d& offset) {
  return {c.pixel + offset, c.T_base_camera, kF, kF, kCx, kCy, kSigma};
}

class ReprojectionFactorTest : public ::testing::TestWithParam<double> {};

TEST_P(ReprojectionFactorTest, JacobiansMatchNumericOnes) {
  std::mt19937 generator(7);
  const PoseManifold manifold;
  const std::vector<const ceres::Manifold*> manifolds = {&manifold, nullptr};
  for (int i = 0; i < 50; ++i) {
    const Case c = RandomCase(generator, GetParam());
    const ReprojectionFactor factor = MakeFactor(c, Eigen::Vector2d(3.0, -2.0));
    double pose[kPoseBlockSize];
    StorePose(c.T_map_base, pose);
    Eigen::Vector3d point = c.p_map;
    const double* blocks[] = {pose, point.data()};
    ceres::NumericDiffOptions numeric;
    numeric.ridders_relative_initial_step_size = 1e-3;
    ceres::GradientChecker checker(&factor, &manifolds, numeric);
    ceres::GradientChecker::ProbeResults results;
    checker.Probe(blocks, 1e-6, &results);
    for (std::size_t b = 0; b < 2; ++b) {
      const double error = (results.local_jacobians[b] - results.local_numeric_jacobians[b]).norm();
      EXPECT_LT(error, 1e-6 * (1.0 + results.local_numeric_jacobians[b].norm())) << "block " << b;
    }
  }
}

TEST_P(ReprojectionFactorTest, ResidualIsZeroAtTruth) {
  std::mt19937 generator(8);
  for (int i = 0; i < 50; ++i) {
    const Case c = RandomCase(generator, GetParam());
    double pose[kPoseBlockSize];
    StorePose(c.T_map_base, pose);
    const double* blocks[] = {pose, c.p_map.data()};
    Eigen::Vector2d residual;
    ASSERT_TRUE(MakeFactor(c, Eigen::Vector2d::Zero()).Evaluate(blocks, residual.data(), nullptr));
    EXPECT_LT(residual.norm(), 1e-9);
  }
}

TEST_P(ReprojectionFactorTest, EqualsItsAutomaticTwin) {
  std::mt19937 generator(11);
  const PoseManifold manifold;
  for (int i = 0; i < 50; ++i) {
    const Case c = RandomCase(generator, GetParam());
    const Eigen::Vector2d offset(3.0, -2.0);
    const ceres::AutoDiffCostFunction<test::ReprojectionTwin, 2, 7, 3> twin(
        new test::ReprojectionTwin{c.pixel + offset, c.T_base_camera.Inverse(), kF, kF, kCx, kCy, kSigma});
    double pose[kPoseBlockSize];
    StorePose(c.T_map_base, pose);
    const double* blocks[] = {pose, c.p_map.data()};
    Eigen::Matrix<double, kPoseBlockSize, 6, Eigen::RowMajor> plus;
    manifold.PlusJacobian(pose, plus.data());
    Eigen::Vector2d residuals[2];
    Eigen::Matrix<double, 2, 7, Eigen::RowMajor> J_pose[2];
    Eigen::Matrix<double, 2, 3, Eigen::RowMajor> J_point[2];
    double* analytic[] = {J_pose[0].data(), J_point[0].data()};
    double* automatic[] = {J_pose[1].data(), J_point[1].data()};
    ASSERT_TRUE(MakeFactor(c, offset).Evaluate(blocks, residuals[0].data(), analytic));
    ASSERT_TRUE(twin.Evaluate(blocks, residuals[1].data(), automatic));
    EXPECT_LT((residuals[0] - residuals[1]).norm(), 1e-9);
    EXPECT_LT((J_pose[0] * plus - J_pose[1] * plus).norm(), 1e-9 * (1.0 + J_pose[1].norm()));
    EXPECT_LT((J_point[0] - J_point[1]).norm(), 1e-9 * (1.0 + J_point[1].norm()));
  }
}

INSTANTIATE_TEST_SUITE_P(RandomAndAtTheSeam, ReprojectionFactorTest,
                         ::testing::Values(std::numeric_limits<double>::quiet_NaN(), M_PI, -M_PI + 1e-9, 0.0));

TEST(ReprojectionFactor, ResidualIsInUnitsOfSigma) {
  std::mt19937 generator(9);
  const Case c = RandomCase(generator, 0.3);
  double pose[kPoseBlockSize];
  StorePose(c.T_map_base, pose);
  const double* blocks[] = {pose, c.p_map.data()};
  Eigen::Vector2d residual;
  MakeFactor(c, Eigen::Vector2d(-kSigma, 0.0)).Evaluate(blocks, residual.data(), nullptr);
  EXPECT_NEAR(residual.x(), 1.0, 1e-9);
  EXPECT_NEAR(residual.y(), 0.0, 1e-9);
}

TEST(ReprojectionFactor, SaysNothingAboutPointsBehindTheCamera) {
  std::mt19937 generator(10);
  Case c = RandomCase(generator, 0.3);
  c.p_map = c.T_map_base * c.T_base_camera * Eigen::Vector3d(0.1, 0.2, -1.0);
  double pose[kPoseBlockSize];
  StorePose(c.T_map_base, pose);
  const double* blocks[] = {pose, c.p_map.data()};
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, 7, Eigen::RowMajor> J_pose;
  Eigen::Matrix<double, 2, 3, Eigen::RowMajor> J_point;
  double* jacobians[] = {J_pose.data(), J_point.data()};
  MakeFactor(c, Eigen::Vector2d::Zero()).Evaluate(blocks, residual.data(), jacobians);
  EXPECT_EQ(residual.norm(), 0.0);
  EXPECT_EQ(J_pose.norm(), 0.0);
  EXPECT_EQ(J_point.norm(), 0.0);
}

}  // namespace
}  // namespace planar_vslam
