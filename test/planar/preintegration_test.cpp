#include "planar_vslam/planar/preintegration.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <random>

#include "support/support.h"

namespace planar_vslam::test {
namespace {

// A path of three arcs (left, right, on the spot), sampled `per_arc` times each, seen from an odometry frame.
std::vector<OdometryReading> ThreeArcs(int per_arc, const Rigid2& T_odom_start) {
  const Eigen::Vector3d twists[] = {{0.8, 0.0, 0.9}, {0.6, 0.1, -1.4}, {0.0, 0.0, 0.7}};
  std::vector<OdometryReading> readings;
  Rigid2 T_odom_arc = T_odom_start;
  std::int64_t arc_start = 0;
  for (const Eigen::Vector3d& twist : twists) {
    for (int k = 0; k < per_arc; ++k) {
      const double fraction = static_cast<double>(k) / per_arc;
      readings.push_back({{arc_start + 1000000000LL * k / per_arc}, T_odom_arc * ExpSe2(fraction * twist)});
    }
    T_odom_arc = T_odom_arc * ExpSe2(twist);
    arc_start += 1000000000;
  }
  readings.push_back({{arc_start}, T_odom_arc});
  return readings;
}

std::vector<OdometryReading> Slice(const std::vector<OdometryReading>& readings, std::size_t first, std::size_t last) {
  return {readings.begin() + static_cast<std::ptrdiff_t>(first),
          readings.begin() + static_cast<std::ptrdiff_t>(last) + 1};
}

void ExpectSamePose(const Rigid2& a, const Rigid2& b, double tolerance) {
  EXPECT_LT((a.translation - b.translation).norm(), tolerance);
  EXPECT_LT(std::abs(WrapAngle(a.angle - b.angle)), tolerance);
}

// Largest relative difference of the variance in any direction: eigenvalues of the whitened matrix against 1.
template <class Matrix>
double VarianceMismatch(const Matrix& covariance, const Matrix& reference) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix> solver(covariance, reference);
  return (solver.eigenvalues().array() - 1.0).abs().maxCoeff();
}

template <class Matrix>
double SmallestEigenvalue(const Matrix& symmetric) {
  return Eigen::SelfAdjointEigenSolver<Matrix>(symmetric).eigenvalues().minCoeff();
}

TEST(Preintegration, MotionIsTheDifferenceOfTheEnds) {
  const std::vector<OdometryReading> readings = ThreeArcs(40, Rigid2(3.0, -1.0, 2.0));
  const PlanarMotion odometry = Preintegrate(readings, OdometryNoise());
  ExpectSamePose(odometry.T_i_j, readings.front().T_odom_base.Inverse() * readings.back().T_odom_base, 1e-12);
  EXPECT_NEAR(odometry.distance, 0.8 + std::hypot(0.6, 0.1), 1e-3);
  EXPECT_NEAR(odometry.turn, 0.9 + 1.4 + 0.7, 1e-9);
  EXPECT_NEAR(odometry.seconds, 3.0, 1e-9);
}

TEST(Preintegration, OneReadingIsTheIdentity) {
  const PlanarMotion odometry = Preintegrate({{{5}, Rigid2(1.0, 2.0, 3.0)}}, OdometryNoise());
  ExpectSamePose(odometry.T_i_j, Rigid2(), 1e-15);
  EXPECT_EQ(odometry.covariance, Eigen::Matrix3d::Zero());
  EXPECT_EQ(odometry.distance, 0.0);
}

TEST(Preintegration, StandingStillKeepsAFloorOfUncertainty) {
  const OdometryNoise noise;
  std::vector<OdometryReading> readings;
  for (int k = 0; k < 100; ++k) readings.push_back({{k}, Rigid2(1.0, 2.0, -3.0)});
  const PlanarMotion odometry = Preintegrate(readings, noise);
  ExpectSamePose(odometry.T_i_j, Rigid2(), 1e-15);
  EXPECT_EQ(odometry.covariance, Eigen::Matrix3d::Zero());
  const Eigen::Matrix3d floor = CovarianceWithFloor(odometry, noise);
  EXPECT_NEAR(std::sqrt(floor(0, 0)), noise.position_floor, 1e-12);
  EXPECT_NEAR(std::sqrt(floor(2, 2)), noise.heading_floor, 1e-12);
  EXPECT_GT(SmallestEigenvalue(floor), 0.0);
  EXPECT_TRUE(SquareRootInformation(LiftedCovariance(odometry, noise)).allFinite());
}

TEST(Preintegration, DoesNotDependOnTheRate) {
  const OdometryNoise noise;
  const Eigen::Matrix3d slow = Preintegrate(ThreeArcs(20, Rigid2()), noise).covariance;
  for (const int per_arc : {40, 80, 400}) {
    const Eigen::Matrix3d fast = Preintegrate(ThreeArcs(per_arc, Rigid2()), noise).covariance;
    EXPECT_LT(VarianceMismatch(fast, slow), 0.02) << per_arc;
  }
}

TEST(Preintegration, DoesNotDependOnTheOdometryFrame) {
  const OdometryNoise noise;
  const PlanarMotion here = Preintegrate(ThreeArcs(20, Rigid2()), noise);
  // Starting headings that put the +-pi seam before, within and after the path.
  for (const double heading : {-M_PI, M_PI - 1.0, M_PI - 0.5, M_PI - 1e-12, M_PI, 1.0, -2.9}) {
    const PlanarMotion there = Preintegrate(ThreeArcs(20, Rigid2(100.0, -50.0, heading)), noise);
    ExpectSamePose(there.T_i_j, here.T_i_j, 1e-10);
    EXPECT_LT((there.covariance - here.covariance).norm(), 1e-12);
    EXPECT_NEAR(there.turn, here.turn, 1e-9);
  }
}

TEST(Preintegration, CountsWholeTurns) {
  std::vector<OdometryReading> readings;
  for (int k = 0; k <= 100; ++k) readings.push_back({{k}, Rigid2(0.0, 0.0, 0.1 * k)});
  const PlanarMotion odometry = Preintegrate(readings, OdometryNoise());
  EXPECT_NEAR(odometry.turn, 10.0, 1e-9);
  EXPECT_NEAR(odometry.T_i_j.angle, WrapAngle(10.0), 1e-9);
}

// Noise of the model drawn on every increment: the spread of the summed poses is the propagated covariance.
TEST(Preintegration, CovarianceMatchesSampledNoise) {
  const OdometryNoise noise;
  const std::vector<OdometryReading> readings = ThreeArcs(15, Rigid2(1.0, 1.0, M_PI - 0.3));
  const PlanarMotion odometry = Preintegrate(readings, noise);
  std::mt19937 generator(11);
  std::normal_distribution<double> normal;
  constexpr int kSamples = 4000;
  Eigen::Matrix3d sampled = Eigen::Matrix3d::Zero();
  for (int sample = 0; sample < kSamples; ++sample) {
    Rigid2 T_i_k;
    for (std::size_t k = 1; k < readings.size(); ++k) {
      const Rigid2 step = readings[k - 1].T_odom_base.Inverse() * readings[k].T_odom_base;
      const Eigen::Vector3d sigma = IncrementCovariance(noise, step).diagonal().cwiseSqrt();
      const double x = normal(generator), y = normal(generator), angle = normal(generator);
      T_i_k = T_i_k * Rigid2(step.translation.x() + sigma.x() * x, step.translation.y() + sigma.y() * y,
                             step.angle + sigma.z() * angle);
    }
    Eigen::Vector3d error;
    error << T_i_k.translation - odometry.T_i_j.translation, WrapAngle(T_i_k.angle - odometry.T_i_j.angle);
    sampled += error * error.transpose() / kSamples;
  }
  EXPECT_LT(VarianceMismatch(sampled, odometry.covariance), 0.15);
}

TEST(Preintegration, StopsOnBrokenPromises) {
  EXPECT_DEATH(Preintegrate({}, OdometryNoise()), "at least one reading");
  EXPECT_DEATH(Preintegrate({{{2}, Rigid2()}, {{1}, Rigid2()}}, OdometryNoise()), "out of order");
}

void ExpectSame(const PlanarMotion& a, const PlanarMotion& b) {
  ExpectSamePose(a.T_i_j, b.T_i_j, 1e-12);
  EXPECT_LT((a.covariance - b.covariance).norm(), 1e-12 * (1.0 + b.covariance.norm()));
  EXPECT_NEAR(a.distance, b.distance, 1e-12);
  EXPECT_NEAR(a.turn, b.turn, 1e-12);
  EXPECT_NEAR(a.seconds, b.seconds, 1e-12);
}

TEST(Compose, EqualsPreintegratingTheWhole) {
  const OdometryNoise noise;
  const std::vector<OdometryReading> readings = ThreeArcs(10, Rigid2(0.0, 0.0, 2.9));
  const PlanarMotion whole = Preintegrate(readings, noise);
  for (std::size_t cut = 0; cut < readings.size(); ++cut) {
    const PlanarMotion ij = Preintegrate(Slice(readings, 0, cut), noise);
    const PlanarMotion jk = Preintegrate(Slice(readings, cut, readings.size() - 1), noise);
    ExpectSame(Compose(ij, jk), whole);
  }
}

TEST(Compose, IsAssociative) {
  const OdometryNoise noise;
  const std::vector<OdometryReading> readings = ThreeArcs(10, Rigid2(0.0, 0.0, -2.9));
  const PlanarMotion a = Preintegrate(Slice(readings, 0, 7), noise);
  const PlanarMotion b = Preintegrate(Slice(readings, 7, 18), noise);
  const PlanarMotion c = Preintegrate(Slice(readings, 18, 30), noise);
  ExpectSame(Compose(Compose(a, b), c), Compose(a, Compose(b, c)));
}

TEST(Compose, StandingStillChangesNothing) {
  const OdometryNoise noise;
  const PlanarMotion still = Preintegrate({{{0}, Rigid2()}}, noise);
  const PlanarMotion moved = Preintegrate(ThreeArcs(10, Rigid2()), noise);
  ExpectSame(Compose(still, moved), moved);
  ExpectSame(Compose(moved, still), moved);
}

TEST(Inflate, TakesTheMissedMotionForStandardDeviation) {
  PlanarMotion step;
  step.T_i_j = Rigid2(0.2, 0.0, 0.4);
  step.covariance = 1e-6 * Eigen::Matrix3d::Identity();
  const PlanarMotion inflated = Inflate(step, {0.03, -0.04, 0.1});
  EXPECT_NEAR(inflated.covariance(0, 0), 0.0025, 1e-5);
  EXPECT_NEAR(inflated.covariance(1, 1), 0.0025, 1e-5);
  EXPECT_NEAR(inflated.covariance(2, 2), 0.01, 1e-5);
  EXPECT_EQ(inflated.T_i_j.angle, step.T_i_j.angle);
  EXPECT_EQ(Inflate(step, Eigen::Vector3d::Zero()).covariance, step.covariance);
}

TEST(LiftedCovariance, IsPositiveDefiniteAndSymmetric) {
  const OdometryNoise noise;
  const std::vector<OdometryReading> readings = ThreeArcs(20, Rigid2());
  for (std::size_t last = 0; last < readings.size(); last += 5) {
    const Matrix6d covariance = LiftedCovariance(Preintegrate(Slice(readings, 0, last), noise), noise);
    EXPECT_LT((covariance - covariance.transpose()).norm(), 1e-15);
    EXPECT_GT(SmallestEigenvalue(covariance), 0.0);
  }
}

// Perturbing T_i_j on the right moves (r, phi) by G d; pushing the lifted covariance through G gives the planar one.
TEST(LiftedCovariance, IsThePlanarCovarianceSeenFromJ) {
  const OdometryNoise noise;
  const PlanarMotion odometry = Preintegrate(ThreeArcs(20, Rigid2()), noise);
  constexpr double kStep = 1e-6;
  Eigen::Matrix<double, 3, 6> G;
  for (int k = 0; k < 6; ++k) {
    const Vector6d d = kStep * Vector6d::Unit(k);
    const Rigid2 ahead = ProjectToPlane(Embed3(odometry.T_i_j) * ExpSe3(d));
    const Rigid2 behind = ProjectToPlane(Embed3(odometry.T_i_j) * ExpSe3(-d));
    G.col(k) << (ahead.translation - behind.translation) / (2.0 * kStep),
        WrapAngle(ahead.angle - behind.angle) / (2.0 * kStep);
  }
  const Matrix6d lifted = LiftedCovariance(odometry, noise);
  const Eigen::Matrix3d planar = CovarianceWithFloor(odometry, noise);
  EXPECT_LT((G * lifted * G.transpose() - planar).norm(), 1e-9 * planar.norm());
  // The path turns, so leaving out the rotation into frame j would show.
  EXPECT_GT((lifted.topLeftCorner<2, 2>() - planar.topLeftCorner<2, 2>()).norm(), 0.05 * planar.norm());
}

TEST(LiftedCovariance, OfAnotherSourceHasNoFloorsOfTheWheels) {
  OdometryNoise noise;
  const PlanarMotion motion = Preintegrate(ThreeArcs(20, Rigid2()), noise);
  const Matrix6d before = LiftedCovariance(motion, motion.covariance, noise);
  EXPECT_TRUE(LiftedCovariance(motion, CovarianceWithFloor(motion, noise), noise)
                  .isApprox(LiftedCovariance(motion, noise), 0.0));
  noise.position_floor *= 10.0;
  noise.heading_floor *= 10.0;
  EXPECT_EQ(LiftedCovariance(motion, motion.covariance, noise), before);
  EXPECT_GT(LiftedCovariance(motion, noise)(0, 0), before(0, 0));
}

TEST(LiftedCovariance, GivesTheFloorsSmoothnessToTheRest) {
  const OdometryNoise noise;
  PlanarMotion odometry;
  odometry.distance = 4.0;
  const Matrix6d covariance = LiftedCovariance(odometry, noise);
  EXPECT_NEAR(covariance(2, 2), std::pow(noise.height_floor, 2) + 4.0 * std::pow(noise.height_per_sqrt_meter, 2),
              1e-15);
  for (const int k : {3, 4}) {
    EXPECT_NEAR(covariance(k, k), std::pow(noise.tilt_floor, 2) + 4.0 * std::pow(noise.tilt_per_sqrt_meter, 2), 1e-15);
  }
  for (const int k : {2, 3, 4}) {
    EXPECT_EQ(covariance.row(k).cwiseAbs().sum(), covariance(k, k));
  }
}

TEST(SquareRootInformation, IsUpperTriangularAndWhitens) {
  const OdometryNoise noise;
  std::mt19937 generator(13);
  std::vector<Matrix6d> covariances = {LiftedCovariance(Preintegrate(ThreeArcs(20, Rigid2()), noise), noise)};
  for (int k = 0; k < 20; ++k) {
    const Matrix6d adjoint = AdjointSe3(RandomRigid3(generator, 2.0));
    covariances.push_back(adjoint * covariances[0] * adjoint.transpose());
  }
  for (const Matrix6d& covariance : covariances) {
    const Matrix6d S = SquareRootInformation(covariance);
    const Matrix6d strictly_lower = S.triangularView<Eigen::StrictlyLower>();
    EXPECT_EQ(strictly_lower, Matrix6d::Zero());
    EXPECT_LT((S * covariance * S.transpose() - Matrix6d::Identity()).norm(), 1e-8);
    EXPECT_LT((S.transpose() * S * covariance - Matrix6d::Identity()).norm(), 1e-6);
  }
}

TEST(SquareRootInformation, StopsOnASingularCovariance) {
  const Matrix6d zero = Matrix6d::Zero();
  EXPECT_DEATH(SquareRootInformation(zero), "not positive definite");
  const Matrix6d nan = Matrix6d::Constant(std::nan(""));
  EXPECT_DEATH(SquareRootInformation(nan), "not positive definite");
}

}  // namespace
}  // namespace planar_vslam::test
