#include "planar_vslam/planar/planar_prior.h"

#include <limits>

#include "factor_testing.h"
#include "support/factor_twins.h"

namespace planar_vslam::test {
namespace {

constexpr double kSigmaHeight = 0.01;
constexpr double kSigmaTilt = DegreesToRadians(0.5);

Eigen::Vector3d Residual(const Rigid3& T) { return PlanarPriorResidual(T, {kSigmaHeight, kSigmaTilt}, nullptr); }

TEST(PlanarPrior, ResidualIsZeroOnTheFloorWhereverItStands) {
  for (const double yaw : {0.0, 0.5, -2.0, M_PI, -M_PI}) {
    EXPECT_LT(Residual(FromYaw(yaw, 12.0, -7.0)).norm(), 1e-12);
  }
}

TEST(PlanarPrior, MeasuresHeightPitchAndRollInSigmas) {
  constexpr double kAngle = 0.01;
  EXPECT_NEAR(Residual(FromYaw(1.0, 2.0, 3.0, 0.03)).x(), 3.0, 1e-12);
  for (const double yaw : {0.0, 0.7, M_PI}) {
    const Rigid3 T = FromYaw(yaw, 1.0, 1.0);
    const Rigid3 pitched = T * ExpSe3(kAngle * Vector6d::Unit(4));
    const Rigid3 rolled = T * ExpSe3(kAngle * Vector6d::Unit(3));
    EXPECT_LT((Residual(pitched) - Eigen::Vector3d(0.0, -std::sin(kAngle) / kSigmaTilt, 0.0)).norm(), 1e-12);
    EXPECT_LT((Residual(rolled) - Eigen::Vector3d(0.0, 0.0, std::sin(kAngle) / kSigmaTilt)).norm(), 1e-12);
  }
}

TEST(PlanarPrior, SaysNothingAboutMotionOnTheFloor) {
  std::mt19937 generator(1);
  for (const Rigid3& T : NastyPoses()) {
    const Rigid3 T_new_map = FromYaw(RandomTangent(generator, M_PI)[0], 3.0, -4.0);
    EXPECT_LT((Residual(T_new_map * T) - Residual(T)).norm(), 1e-10);
  }
}

TEST(PlanarPrior, GradientsAreRight) {
  for (const Rigid3& T : NastyPoses()) {
    ExpectGradientsRight(PlanarPriorFactor({kSigmaHeight, kSigmaTilt}), {ToBlock(T)});
  }
}

TEST(PlanarPrior, EqualsItsAutomaticTwin) {
  const ceres::AutoDiffCostFunction<PlanarPriorTwin, 3, 7> twin(new PlanarPriorTwin{kSigmaHeight, kSigmaTilt});
  for (const Rigid3& T : NastyPoses()) {
    ExpectTwins(PlanarPriorFactor({kSigmaHeight, kSigmaTilt}), twin, {ToBlock(T)});
  }
}

TEST(PlanarPrior, EvaluatesWithoutJacobians) {
  const Block block = ToBlock(NastyPoses()[3]);
  const double* parameters[1] = {block.data()};
  double* no_jacobians[1] = {nullptr};
  Eigen::Vector3d a, b;
  const PlanarPriorFactor factor({kSigmaHeight, kSigmaTilt});
  ASSERT_TRUE(factor.Evaluate(parameters, a.data(), nullptr));
  ASSERT_TRUE(factor.Evaluate(parameters, b.data(), no_jacobians));
  EXPECT_EQ(a, b);
  EXPECT_EQ(a, Residual(LoadPose(block.data())));
}

TEST(PlanarPriorOptions, NamesEachBadField) {
  EXPECT_TRUE(PlanarPriorOptions().Problems().empty());
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -1.0, nan, infinity}) {
    PlanarPriorOptions options;
    options.sigma_height = bad;
    ASSERT_EQ(options.Problems().size(), 1u) << bad;
    EXPECT_EQ(options.Problems()[0].rfind("sigma_height is ", 0), 0u);
    options.sigma_tilt = bad;
    ASSERT_EQ(options.Problems().size(), 2u) << bad;
    EXPECT_EQ(options.Problems()[1].rfind("sigma_tilt_deg is ", 0), 0u);
  }
}

}  // namespace
}  // namespace planar_vslam::test
