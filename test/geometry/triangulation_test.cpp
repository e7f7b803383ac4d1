#include "planar_vslam/geometry/triangulation.h"

#include <gtest/gtest.h>

#include <random>

#include "support/support.h"

namespace planar_vslam {
namespace {

TEST(Triangulation, RecoversExactPointsWhateverTheLengthOfTheRays) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> side(-2.0, 2.0), depth(1.0, 10.0), length(0.1, 10.0);
  for (int i = 0; i < 200; ++i) {
    const Rigid3 T_a_b(ExpSo3(0.1 * Eigen::Vector3d(side(generator), side(generator), side(generator))),
                       Eigen::Vector3d(0.5, 0.1, -0.2));
    const Eigen::Vector3d p_a(side(generator), side(generator), depth(generator));
    const Eigen::Vector3d p_b = T_a_b.Inverse() * p_a;
    const auto found = TriangulateTwoRays(length(generator) * p_a, length(generator) * p_b, T_a_b);
    ASSERT_TRUE(found);
    EXPECT_LT((*found - p_a).norm(), 1e-9 * p_a.norm());
  }
}

TEST(Triangulation, NoisyRaysGiveANearbyPointAtAnyScale) {
  const Eigen::Vector3d direction_error(2e-4, -3e-4, 0.0);
  for (const double scale : {1e-3, 1.0, 1e3}) {
    const Rigid3 T_a_b(Eigen::Quaterniond::Identity(), scale * Eigen::Vector3d(1.0, 0.0, 0.0));
    const Eigen::Vector3d p_a = scale * Eigen::Vector3d(0.5, 0.2, 4.0);
    const auto found = TriangulateTwoRays(p_a / p_a.z() + direction_error, T_a_b.Inverse() * p_a, T_a_b);
    ASSERT_TRUE(found);
    EXPECT_LT((*found - p_a).norm(), 0.01 * p_a.norm());
  }
}

TEST(Triangulation, RefusesParallelRaysPointsBehindAndNoBaseline) {
  const Eigen::Vector3d forward = Eigen::Vector3d::UnitZ();
  const Rigid3 sideways(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1.0, 0.0, 0.0));
  EXPECT_FALSE(TriangulateTwoRays(forward, forward, sideways));
  EXPECT_FALSE(TriangulateTwoRays(forward, Eigen::Vector3d(0.1, 0.0, 1.0), sideways)) << "rays meet behind";
  EXPECT_TRUE(TriangulateTwoRays(forward, Eigen::Vector3d(-0.1, 0.0, 1.0), sideways));
  EXPECT_FALSE(TriangulateTwoRays(forward, Eigen::Vector3d(-0.1, 0.0, 1.0), Rigid3()));
}

TEST(Triangulation, ParallaxIsTheAngleAtThePoint) {
  const Eigen::Vector3d point(0.0, 0.0, 2.0);
  EXPECT_NEAR(ParallaxAngle(point, Eigen::Vector3d(0.0, 0.0, 0.0), Eigen::Vector3d(2.0, 0.0, 2.0)), M_PI / 2, 1e-15);
  EXPECT_NEAR(ParallaxAngle(point, Eigen::Vector3d(0.0, 0.0, 0.0), Eigen::Vector3d(0.0, 0.0, 1.0)), 0.0, 1e-15);
  EXPECT_NEAR(ParallaxAngle(point, Eigen::Vector3d(-1e-6, 0.0, 0.0), Eigen::Vector3d(1e-6, 0.0, 0.0)), 1e-6, 1e-12);
}

}  // namespace
}  // namespace planar_vslam
