#include "planar_vslam/geometry/rigid3.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "support/support.h"

namespace planar_vslam {
namespace {

constexpr int kRounds = 200;
// Rotation angles where series end, closed forms begin or branches meet.
const double kAngles[] = {0.0, 1e-12, 1e-8, 1e-5, 1e-3, 0.0999, 0.1001, 0.5, 1.5, 3.0, M_PI - 1e-3, M_PI - 1e-8};

void ExpectNear(const Rigid3& a, const Rigid3& b, double tolerance) {
  EXPECT_LT((a.translation - b.translation).norm(), tolerance);
  EXPECT_LT(a.rotation.angularDistance(b.rotation), tolerance);
}

Eigen::Vector3d RandomUnit(std::mt19937& generator) {
  std::normal_distribution<double> normal;
  const double x = normal(generator), y = normal(generator);
  return Eigen::Vector3d(x, y, normal(generator)).normalized();
}

Vector6d RandomTwist(std::mt19937& generator, double angle) {
  Vector6d xi;
  xi << 2.0 * RandomUnit(generator), angle * RandomUnit(generator);
  return xi;
}

template <int N>
Eigen::Matrix<double, N, N> NumericJacobian(
    const std::function<Eigen::Matrix<double, N, 1>(const Eigen::Matrix<double, N, 1>&)>& f) {
  constexpr double kStep = 1e-5;
  Eigen::Matrix<double, N, N> jacobian;
  for (int k = 0; k < N; ++k) {
    const Eigen::Matrix<double, N, 1> d = kStep * Eigen::Matrix<double, N, 1>::Unit(k);
    jacobian.col(k) = (f(d) - f(-d)) / (2.0 * kStep);
  }
  return jacobian;
}

TEST(Rigid3, IsAGroupThatActsOnPoints) {
  std::mt19937 generator(1);
  for (int i = 0; i < kRounds; ++i) {
    const Rigid3 T_a_b = test::RandomRigid3(generator, 5.0);
    const Rigid3 T_b_c = test::RandomRigid3(generator, 5.0);
    const Rigid3 T_c_d = test::RandomRigid3(generator, 5.0);
    const Eigen::Vector3d p_c(1.5, -0.7, 0.3);
    ExpectNear((T_a_b * T_b_c) * T_c_d, T_a_b * (T_b_c * T_c_d), 1e-12);
    ExpectNear(T_a_b * T_a_b.Inverse(), Rigid3(), 1e-12);
    ExpectNear(T_a_b.Inverse() * T_a_b, Rigid3(), 1e-12);
    EXPECT_LT(((T_a_b * T_b_c) * p_c - T_a_b * (T_b_c * p_c)).norm(), 1e-12);
    EXPECT_LT((T_a_b.R() * p_c + T_a_b.translation - T_a_b * p_c).norm(), 1e-12);
  }
}

TEST(Rigid3, SkewIsTheCrossProduct) {
  const Eigen::Vector3d a(1.0, -2.0, 3.0), b(0.4, 0.5, -0.6);
  EXPECT_LT((Skew(a) * b - a.cross(b)).norm(), 1e-15);
}

TEST(So3, LogInvertsExpAndStaysWithinPi) {
  std::mt19937 generator(2);
  for (const double angle : kAngles) {
    const Eigen::Vector3d phi = angle * RandomUnit(generator);
    const Eigen::Quaterniond q = ExpSo3(phi);
    EXPECT_NEAR(q.norm(), 1.0, 1e-15);
    EXPECT_LT((LogSo3(q) - phi).norm(), 1e-12) << angle;
    const Eigen::Quaterniond same(-q.w(), -q.x(), -q.y(), -q.z());
    EXPECT_LT((LogSo3(same) - phi).norm(), 1e-12) << angle;
  }
  const Eigen::Vector3d half_turn = LogSo3(Eigen::Quaterniond(0.0, 0.0, 0.0, 1.0));
  EXPECT_NEAR(half_turn.norm(), M_PI, 1e-15);
  const Eigen::Vector3d beyond = LogSo3(ExpSo3(Eigen::Vector3d(0.0, 0.0, 1.5 * M_PI)));
  EXPECT_LT((beyond - Eigen::Vector3d(0.0, 0.0, -0.5 * M_PI)).norm(), 1e-12);
}

TEST(So3, ExpTurnsAroundItsAxis) {
  const Eigen::Quaterniond q = ExpSo3(Eigen::Vector3d(0.0, 0.0, 0.7));
  EXPECT_LT((q * Eigen::Vector3d::UnitX() - Eigen::Vector3d(std::cos(0.7), std::sin(0.7), 0.0)).norm(), 1e-15);
}

TEST(So3, RightJacobianMatchesDifferencesAndItsInverse) {
  std::mt19937 generator(3);
  for (const double angle : kAngles) {
    const Eigen::Vector3d phi = angle * RandomUnit(generator);
    const Eigen::Matrix3d jacobian = RightJacobianSo3(phi);
    const Eigen::Matrix3d numeric = NumericJacobian<3>(
        [&phi](const Eigen::Vector3d& d) { return LogSo3(ExpSo3(phi).conjugate() * ExpSo3(phi + d)); });
    EXPECT_LT((jacobian - numeric).norm(), 1e-8) << angle;
    EXPECT_LT((jacobian * RightJacobianInverseSo3(phi) - Eigen::Matrix3d::Identity()).norm(), 1e-12) << angle;
  }
}

TEST(Se3, LogInvertsExp) {
  std::mt19937 generator(4);
  for (const double angle : kAngles) {
    const Vector6d xi = RandomTwist(generator, angle);
    EXPECT_LT((LogSe3(ExpSe3(xi)) - xi).norm(), 1e-11) << angle;
  }
  for (int i = 0; i < kRounds; ++i) {
    const Rigid3 T = test::RandomRigid3(generator, 5.0);
    ExpectNear(ExpSe3(LogSe3(T)), T, 1e-11);
  }
}

TEST(Se3, ExpIsTheLimitOfManySmallSteps) {
  Vector6d xi;
  xi << 0.5, -0.3, 0.8, 1.1, -0.9, 0.6;
  constexpr int kDoublings = 24;
  const Vector6d step = xi / std::pow(2.0, kDoublings);
  Rigid3 T(ExpSo3(step.tail<3>()), step.head<3>());
  for (int i = 0; i < kDoublings; ++i) T = T * T;
  ExpectNear(T, ExpSe3(xi), 1e-6);
}

TEST(Se3, AdjointMovesAPerturbationFromRightToLeft) {
  std::mt19937 generator(5);
  for (int i = 0; i < kRounds; ++i) {
    const Rigid3 T = test::RandomRigid3(generator, 3.0);
    const Vector6d xi = RandomTwist(generator, 0.8);
    ExpectNear(T * ExpSe3(xi) * T.Inverse(), ExpSe3(AdjointSe3(T) * xi), 1e-11);
  }
}

TEST(Se3, RightJacobianInverseMatchesDifferences) {
  std::mt19937 generator(6);
  for (const double angle : kAngles) {
    if (angle > 3.1) continue;  // differences would step over the cut of the logarithm
    const Vector6d xi = RandomTwist(generator, angle);
    const Matrix6d numeric = NumericJacobian<6>([&xi](const Vector6d& d) { return LogSe3(ExpSe3(xi) * ExpSe3(d)); });
    EXPECT_LT((RightJacobianInverseSe3(xi) - numeric).norm(), 1e-7) << angle;
  }
}

TEST(Se3, RightJacobianInverseMatchesDifferencesAtYawPi) {
  for (const double yaw : {M_PI - 1e-3, -M_PI + 1e-3}) {
    Vector6d xi;
    xi << 1.0, -2.0, 0.1, 0.0, 0.0, yaw;
    const Matrix6d numeric = NumericJacobian<6>([&xi](const Vector6d& d) { return LogSe3(ExpSe3(xi) * ExpSe3(d)); });
    EXPECT_LT((RightJacobianInverseSe3(xi) - numeric).norm(), 1e-7) << yaw;
  }
}

TEST(Se3, RightJacobianInverseIsSmoothWhereTheSeriesEnds) {
  std::mt19937 generator(7);
  const Eigen::Vector3d rho = RandomUnit(generator), axis = RandomUnit(generator);
  Vector6d below, above;
  below << rho, (0.1 - 1e-10) * axis;
  above << rho, (0.1 + 1e-10) * axis;
  EXPECT_LT((RightJacobianInverseSe3(below) - RightJacobianInverseSe3(above)).norm(), 1e-9);
}

TEST(Rigid3, InterpolationMeetsBothEndsAtConstantTwist) {
  std::mt19937 generator(8);
  for (int i = 0; i < kRounds; ++i) {
    const Rigid3 T_a = test::RandomRigid3(generator, 3.0);
    const Rigid3 T_b = T_a * ExpSe3(RandomTwist(generator, 2.0));
    ExpectNear(Interpolate(T_a, T_b, 0.0), T_a, 1e-11);
    ExpectNear(Interpolate(T_a, T_b, 1.0), T_b, 1e-11);
    const Rigid3 middle = Interpolate(T_a, T_b, 0.5);
    ExpectNear(T_a.Inverse() * middle, middle.Inverse() * T_b, 1e-11);
  }
}

TEST(Plane, EmbeddingIsAHomomorphismThatProjectionUndoes) {
  std::mt19937 generator(9);
  for (int i = 0; i < kRounds; ++i) {
    const Rigid2 a = test::RandomRigid2(generator, 5.0);
    const Rigid2 b = test::RandomRigid2(generator, 5.0);
    ExpectNear(Embed3(a * b), Embed3(a) * Embed3(b), 1e-11);
    const Rigid2 back = ProjectToPlane(Embed3(a));
    EXPECT_LT((back.translation - a.translation).norm(), 1e-12);
    EXPECT_LT(std::abs(WrapAngle(back.angle - a.angle)), 1e-12);
  }
}

TEST(Plane, ProjectionKeepsTheHeadingOfATiltedBody) {
  const Rigid3 tilted(ExpSo3(Eigen::Vector3d(0.0, 0.0, -2.0)) * ExpSo3(Eigen::Vector3d(0.0, 0.3, 0.0)) *
                          ExpSo3(Eigen::Vector3d(0.2, 0.0, 0.0)),
                      Eigen::Vector3d(1.0, 2.0, 3.0));
  const Rigid2 projected = ProjectToPlane(tilted);
  EXPECT_NEAR(projected.angle, -2.0, 1e-12);
  EXPECT_EQ(projected.translation, Eigen::Vector2d(1.0, 2.0));
}

}  // namespace
}  // namespace planar_vslam
