#include "planar_vslam/geometry/rigid2.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "support/support.h"

namespace planar_vslam {
namespace {

constexpr int kRounds = 200;

void ExpectNear(const Rigid2& a, const Rigid2& b, double tolerance) {
  EXPECT_LT((a.translation - b.translation).norm(), tolerance);
  EXPECT_LT(std::abs(WrapAngle(a.angle - b.angle)), tolerance);
}

TEST(Angles, WrapKeepsTheAngleAndTheHalfOpenInterval) {
  for (int i = -1000; i <= 1000; ++i) {
    const double angle = 0.0371 * i;
    const double wrapped = WrapAngle(angle);
    EXPECT_GT(wrapped, -M_PI);
    EXPECT_LE(wrapped, M_PI);
    EXPECT_NEAR(std::cos(angle), std::cos(wrapped), 1e-12);
    EXPECT_NEAR(std::sin(angle), std::sin(wrapped), 1e-12);
  }
  EXPECT_DOUBLE_EQ(WrapAngle(-M_PI), M_PI);
  EXPECT_DOUBLE_EQ(WrapAngle(M_PI), M_PI);
}

TEST(Rigid2, IsAGroupThatActsOnPoints) {
  std::mt19937 generator(1);
  for (int i = 0; i < kRounds; ++i) {
    const Rigid2 T_a_b = test::RandomRigid2(generator, 5.0);
    const Rigid2 T_b_c = test::RandomRigid2(generator, 5.0);
    const Rigid2 T_c_d = test::RandomRigid2(generator, 5.0);
    const Eigen::Vector2d p_c(1.5, -0.7);
    ExpectNear((T_a_b * T_b_c) * T_c_d, T_a_b * (T_b_c * T_c_d), 1e-12);
    ExpectNear(T_a_b * T_a_b.Inverse(), Rigid2(), 1e-12);
    ExpectNear(T_a_b.Inverse() * T_a_b, Rigid2(), 1e-12);
    EXPECT_LT(((T_a_b * T_b_c) * p_c - T_a_b * (T_b_c * p_c)).norm(), 1e-12);
    EXPECT_LT((T_a_b.R() * p_c + T_a_b.translation - T_a_b * p_c).norm(), 1e-12);
  }
}

TEST(Rigid2, LogInvertsExp) {
  std::mt19937 generator(2);
  std::uniform_real_distribution<double> position(-3.0, 3.0);
  for (const double angle :
       {0.0, 1e-12, -1e-9, 9.9e-5, 1.01e-4, 1e-3, -0.3, 1.0, M_PI / 2, 3.0, -3.1, M_PI - 1e-9, M_PI}) {
    const double x = position(generator);
    const Eigen::Vector3d xi(x, position(generator), angle);
    EXPECT_LT((LogSe2(ExpSe2(xi)) - xi).norm(), 1e-11) << angle;
  }
  for (int i = 0; i < kRounds; ++i) {
    const Rigid2 T = test::RandomRigid2(generator, 5.0);
    ExpectNear(ExpSe2(LogSe2(T)), T, 1e-11);
  }
}

TEST(Rigid2, ExpIsTheLimitOfManySmallSteps) {
  const Eigen::Vector3d xi(0.8, -0.4, 2.5);
  constexpr int kDoublings = 24;
  const Eigen::Vector3d step = xi / std::pow(2.0, kDoublings);
  Rigid2 T(step.x(), step.y(), step.z());
  for (int i = 0; i < kDoublings; ++i) T = T * T;
  ExpectNear(T, ExpSe2(xi), 1e-6);
}

TEST(Rigid2, AdjointCarriesAMotionAcrossAPose) {
  const Eigen::Vector3d d(0.01, -0.02, 0.03);
  for (const double angle : {0.0, 0.7, -2.5, M_PI}) {
    const Rigid2 T(1.5, -0.4, angle);
    const Rigid2 after = T * ExpSe2(d), before = ExpSe2(AdjointSe2(T) * d) * T;
    EXPECT_LT((after.translation - before.translation).norm(), 1e-12);
    EXPECT_NEAR(WrapAngle(after.angle - before.angle), 0.0, 1e-12);
  }
}

TEST(Rigid2, InterpolationMeetsBothEndsAndTakesTheShortWayAcrossPi) {
  const Rigid2 T_a(1.0, 2.0, M_PI - 0.1);
  const Rigid2 T_b(1.5, 2.5, -M_PI + 0.1);
  ExpectNear(Interpolate(T_a, T_b, 0.0), T_a, 1e-12);
  ExpectNear(Interpolate(T_a, T_b, 1.0), T_b, 1e-12);
  EXPECT_NEAR(std::abs(Interpolate(T_a, T_b, 0.5).angle), M_PI, 1e-12);
  const Rigid2 first = T_a.Inverse() * Interpolate(T_a, T_b, 0.25);
  const Rigid2 second = Interpolate(T_a, T_b, 0.25).Inverse() * Interpolate(T_a, T_b, 0.5);
  ExpectNear(first, second, 1e-12);
}

}  // namespace
}  // namespace planar_vslam
