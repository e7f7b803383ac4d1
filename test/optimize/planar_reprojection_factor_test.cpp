#include "planar_vslam/optimize/planar_reprojection_factor.h"

#include <ceres/gradient_checker.h>
#include <gtest/gtest.h>

#include "planar_vslam/planar/pose_manifold.h"
#include "support/factor_twins.h"
#include "support/support.h"

namespace planar_vslam {
namespace {

constexpr double kF = 600.0, kCx = 320.0, kCy = 240.0, kSigma = 1.3;
constexpr double kSigmaHeight = 0.01, kSigmaTilt = DegreesToRadians(0.5);

struct Case {
  Rigid3 T_map_base, T_base_camera;
  Eigen::Vector3d p_map;
  Eigen::Vector2d pixel;  // where the point is seen

  Case(std::mt19937& generator, double yaw) {
    std::uniform_real_distribution<double> side(-1.0, 1.0), depth(1.0, 6.0), angle(-M_PI, M_PI);
    T_map_base = Embed3(Rigid2(1.0, -2.0, std::isfinite(yaw) ? yaw : angle(generator)));
    T_base_camera = test::RandomRigid3(generator, 1.0);
    const double z = depth(generator);
    const Eigen::Vector3d p_camera(side(generator) * 0.4 * z, side(generator) * 0.3 * z, z);
    p_map = T_map_base * T_base_camera * p_camera;
    pixel = {kF * p_camera.x() / z + kCx, kF * p_camera.y() / z + kCy};
  }
  ReprojectionFactor Reprojection(const Eigen::Vector2d& offset) const {
    return {pixel + offset, T_base_camera, kF, kF, kCx, kCy, kSigma};
  }
  Eigen::Vector2d Error(const Rigid3& T) const {
    double pose[kPoseBlockSize];
    StorePose(T, pose);
    const double* blocks[] = {pose, p_map.data()};
    Eigen::Vector2d e;
    EXPECT_TRUE(Reprojection(Eigen::Vector2d::Zero()).Evaluate(blocks, e.data(), nullptr));
    return e;
  }
};

struct Blocks {
  double pose[kPoseBlockSize];
  Eigen::Vector3d point;
  const double* all[2];

  explicit Blocks(const Case& c) : point(c.p_map), all{pose, point.data()} { StorePose(c.T_map_base, pose); }
  Blocks(const Blocks&) = delete;
};

Eigen::Matrix2d Whitening(const Case& c) {
  const Blocks blocks(c);
  return FloorWhitening(c.Reprojection(Eigen::Vector2d::Zero()), blocks.pose, blocks.point.data(), kSigmaHeight,
                        kSigmaTilt);
}

class PlanarReprojection : public ::testing::TestWithParam<double> {};

TEST_P(PlanarReprojection, JacobiansMatchNumericOnesOnBothManifolds) {
  std::mt19937 generator(7);
  const PoseManifold space;
  const FloorPoseManifold floor;
  for (int i = 0; i < 50; ++i) {
    const Case c(generator, GetParam());
    const ReprojectionFactor reprojection = c.Reprojection({3.0, -2.0});
    const PlanarReprojectionFactor factor(reprojection, Whitening(c));
    const Blocks blocks(c);
    for (const ceres::Manifold* manifold :
         {static_cast<const ceres::Manifold*>(&space), static_cast<const ceres::Manifold*>(&floor)}) {
      const std::vector<const ceres::Manifold*> manifolds = {manifold, nullptr};
      ceres::NumericDiffOptions numeric;
      numeric.ridders_relative_initial_step_size = 1e-3;
      ceres::GradientChecker checker(&factor, &manifolds, numeric);
      ceres::GradientChecker::ProbeResults results;
      checker.Probe(blocks.all, 1e-6, &results);
      for (std::size_t b = 0; b < 2; ++b) {
        const double error = (results.local_jacobians[b] - results.local_numeric_jacobians[b]).norm();
        EXPECT_LT(error, 1e-6 * (1.0 + results.local_numeric_jacobians[b].norm())) << "block " << b;
      }
    }
  }
}

TEST_P(PlanarReprojection, EqualsItsAutomaticTwin) {
  std::mt19937 generator(11);
  for (int i = 0; i < 50; ++i) {
    const Case c(generator, GetParam());
    const Eigen::Vector2d offset(3.0, -2.0);
    const ReprojectionFactor reprojection = c.Reprojection(offset);
    const PlanarReprojectionFactor factor(reprojection, Whitening(c));
    const ceres::AutoDiffCostFunction<test::PlanarReprojectionTwin, 2, 7, 3> twin(new test::PlanarReprojectionTwin{
        {c.pixel + offset, c.T_base_camera.Inverse(), kF, kF, kCx, kCy, kSigma}, Whitening(c)});
    const Blocks blocks(c);
    Eigen::Matrix<double, kPoseBlockSize, 3, Eigen::RowMajor> plus;
    FloorPoseManifold().PlusJacobian(blocks.pose, plus.data());
    Eigen::Vector2d residuals[2];
    Eigen::Matrix<double, 2, 7, Eigen::RowMajor> J_pose[2];
    Eigen::Matrix<double, 2, 3, Eigen::RowMajor> J_point[2];
    double* analytic[] = {J_pose[0].data(), J_point[0].data()};
    double* automatic[] = {J_pose[1].data(), J_point[1].data()};
    ASSERT_TRUE(factor.Evaluate(blocks.all, residuals[0].data(), analytic));
    ASSERT_TRUE(twin.Evaluate(blocks.all, residuals[1].data(), automatic));
    EXPECT_LT((residuals[0] - residuals[1]).norm(), 1e-9);
    EXPECT_LT((J_pose[0] * plus - J_pose[1] * plus).norm(), 1e-9 * (1.0 + J_pose[1].norm()));
    EXPECT_LT((J_point[0] - J_point[1]).norm(), 1e-9 * (1.0 + J_point[1].norm()));
  }
}

TEST_P(PlanarReprojection, IsZeroAtTruth) {
  std::mt19937 generator(8);
  for (int i = 0; i < 50; ++i) {
    const Case c(generator, GetParam());
    const ReprojectionFactor reprojection = c.Reprojection(Eigen::Vector2d::Zero());
    const Blocks blocks(c);
    Eigen::Vector2d residual;
    ASSERT_TRUE(PlanarReprojectionFactor(reprojection, Whitening(c)).Evaluate(blocks.all, residual.data(), nullptr));
    EXPECT_LT(residual.norm(), 1e-9);
  }
}

TEST_P(PlanarReprojection, FloorJacobianMatchesDifferences) {
  std::mt19937 generator(9);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 50; ++i) {
    const Case c(generator, GetParam());
    const auto swayed = [&c](double height, double x, double y) {
      return Rigid3(ExpSo3({x, y, 0.0}) * c.T_map_base.rotation,
                    Eigen::Vector3d(c.T_map_base.translation + Eigen::Vector3d(0.0, 0.0, height)));
    };
    const Blocks blocks(c);
    Eigen::Vector2d e;
    Eigen::Matrix<double, 2, 3, Eigen::RowMajor> J_point;
    double* jacobians[] = {nullptr, J_point.data()};
    ASSERT_TRUE(c.Reprojection(Eigen::Vector2d::Zero()).Evaluate(blocks.all, e.data(), jacobians));
    const Eigen::Matrix<double, 2, 3> J = FloorErrorJacobian(J_point, c.p_map - c.T_map_base.translation);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d d = kStep * Eigen::Vector3d::Unit(k);
      const Eigen::Vector2d difference =
          (c.Error(swayed(d[0], d[1], d[2])) - c.Error(swayed(-d[0], -d[1], -d[2]))) / (2.0 * kStep);
      EXPECT_LT((J.col(k) - difference).norm(), 1e-5 * (1.0 + difference.norm())) << k;
    }
  }
}

TEST_P(PlanarReprojection, ErrorsOfASwayingBaseAreWhite) {
  std::mt19937 generator(10);
  std::normal_distribution<double> normal;
  const Case c(generator, GetParam());
  const Eigen::Matrix2d W = Whitening(c);
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  constexpr int kDraws = 4000;
  for (int i = 0; i < kDraws; ++i) {
    const Rigid3 swayed(
        ExpSo3({kSigmaTilt * normal(generator), kSigmaTilt * normal(generator), 0.0}) * c.T_map_base.rotation,
        Eigen::Vector3d(c.T_map_base.translation + Eigen::Vector3d(0.0, 0.0, kSigmaHeight * normal(generator))));
    const Eigen::Vector2d e = W * (c.Error(swayed) + Eigen::Vector2d(normal(generator), normal(generator)));
    sum += e * e.transpose();
  }
  EXPECT_LT((sum / kDraws - Eigen::Matrix2d::Identity()).norm(), 0.12);
}

INSTANTIATE_TEST_SUITE_P(RandomAndAtTheSeam, PlanarReprojection,
                         ::testing::Values(std::numeric_limits<double>::quiet_NaN(), M_PI, -M_PI, -M_PI + 1e-9, 0.0));

TEST(FloorWhitening, NeverCountsMoreThanThePixels) {
  std::mt19937 generator(12);
  for (int i = 0; i < 50; ++i) {
    const Case c(generator, 0.3);
    const Eigen::Vector2d e = test::RandomRigid3(generator, 1.0).translation.head<2>();
    EXPECT_LE((Whitening(c) * e).norm(), e.norm());
  }
  EXPECT_EQ(FloorWhitening(Eigen::Matrix<double, 2, 3>::Zero(), 0.01, 0.01), Eigen::Matrix2d::Identity());
}

}  // namespace
}  // namespace planar_vslam
