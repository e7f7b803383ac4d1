#include "planar_vslam/planar/message_covariance.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <functional>
#include <limits>

#include "planar_vslam/planar/preintegration.h"

namespace planar_vslam::test {
namespace {

using Matrices = OdometryMessageCovariance;
using Diagonal = Eigen::Vector3d;

constexpr int kSteps = 40;
constexpr double kSecondsBetween = 0.02;

Timestamp At(int k) { return Timestamp::FromSeconds(kSecondsBetween * k); }
// Along a curve that crosses the seam of the heading.
Rigid2 PoseAt(int k) { return Rigid2(1.0, -2.0, 2.8) * ExpSe2(Eigen::Vector3d(0.5, 0.05, 0.8) * kSecondsBetween * k); }
Eigen::Matrix3d StepCovariance() {
  Eigen::Matrix3d Q = Diagonal(4e-6, 1e-6, 2e-6).asDiagonal();
  Q(0, 1) = Q(1, 0) = 5e-7;
  return Q;
}

// Rates the reader gives for a drive whose messages carry `covariance(k)`.
std::vector<std::optional<Eigen::Matrix3d>> Rates(const std::function<Matrices(int)>& covariance) {
  MessageCovarianceReader reader;
  std::vector<std::optional<Eigen::Matrix3d>> rates;
  for (int k = 0; k <= kSteps; ++k) rates.push_back(reader.Rate(At(k), PoseAt(k), covariance(k)));
  return rates;
}

void ExpectNone(const std::vector<std::optional<Eigen::Matrix3d>>& rates, const char* what) {
  for (const auto& rate : rates) EXPECT_FALSE(rate.has_value()) << what;
}

constexpr std::size_t kEarned = 10;  // messages after which belief has been earned

void ExpectRate(const std::vector<std::optional<Eigen::Matrix3d>>& rates, const Eigen::Matrix3d& expected) {
  EXPECT_FALSE(rates[0].has_value()) << "nothing came before the first message";
  for (std::size_t k = kEarned; k < rates.size(); ++k) {
    ASSERT_TRUE(rates[k].has_value()) << k;
    EXPECT_LT((*rates[k] - expected).norm(), 1e-4 * expected.norm()) << k << "\n" << *rates[k];
  }
}

// Accumulated the way dead reckoning propagates, from `start` on.
std::vector<Eigen::Matrix3d> Propagated(const Eigen::Matrix3d& start) {
  std::vector<Eigen::Matrix3d> P = {start};
  for (int k = 0; k < kSteps; ++k) {
    const Eigen::Vector2d dr = PoseAt(k + 1).translation - PoseAt(k).translation;
    Eigen::Matrix3d A = Eigen::Matrix3d::Identity(), B = A;
    A(0, 2) = -dr.y();
    A(1, 2) = dr.x();
    B.topLeftCorner<2, 2>() = PoseAt(k).R();
    P.push_back(A * P.back() * A.transpose() + B * StepCovariance() * B.transpose());
  }
  return P;
}

TEST(MessageCovariance, TakesBackWhatDeadReckoningAccumulated) {
  const std::vector<Eigen::Matrix3d> P = Propagated(Diagonal(1e-3, 2e-3, 1e-2).asDiagonal());
  ExpectRate(Rates([&P](int k) {
               return Matrices{P[static_cast<std::size_t>(k)], {}};
             }),
             StepCovariance() / kSecondsBetween);
}

TEST(MessageCovariance, TakesBackWhatADriverAddedUp) {
  const Eigen::Matrix3d Q = Diagonal(3e-6, 3e-6, 1e-6).asDiagonal();  // round, so that axes do not matter
  ExpectRate(Rates([&Q](int k) { return Matrices{(1000.0 + k) * Q, {}}; }), Q / kSecondsBetween);
}

// One that grows with the speed, which changes.
Eigen::Matrix3d TwistOf(int k) { return (1.0 + 1e-6 * k) * Eigen::Matrix3d(Diagonal(1e-3, 2e-3, 4e-3).asDiagonal()); }

TEST(MessageCovariance, FallsBackOnTheTwist) {
  for (const double pose : {0.0, 1e-9, 1e6, 99999.0, 0.01, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    ExpectRate(Rates([&](int k) { return Matrices{pose * Eigen::Matrix3d::Identity(), TwistOf(k)}; }), TwistOf(20));
  }
}

TEST(MessageCovariance, AFewMatricesWhateverTheRobotDoesArePlaceholders) {
  const Eigen::Matrix3d driving = Diagonal(1e-3, 1e-3, 1e-2).asDiagonal();
  const Eigen::Matrix3d standing = Diagonal(1e-6, 1e-6, 1e-6).asDiagonal();
  const std::function<Matrices(int)> streams[] = {
      [&](int) {
        return Matrices{driving, driving};
      },
      [&](int) {
        return Matrices{{}, driving};
      },
      [&](int) {
        return Matrices{driving, {}};
      },
      [&](int k) {
        return k % 7 < 3 ? Matrices{standing, standing} : Matrices{driving, driving};
      },
      [&](int k) {
        return Matrices{{}, (1.0 + k % 3) * driving};
      }};
  for (const auto& stream : streams) {
    MessageCovarianceReader reader;
    for (int k = 0; k <= kSteps; ++k) EXPECT_FALSE(reader.Rate(At(k), PoseAt(k), stream(k)).has_value()) << k;
    EXPECT_TRUE(reader.placeholder());
  }
  MessageCovarianceReader none, earned;
  for (int k = 0; k <= kSteps; ++k) {
    none.Rate(At(k), PoseAt(k), {});
    earned.Rate(At(k), PoseAt(k), {{}, TwistOf(k)});
    EXPECT_FALSE(none.placeholder() || earned.placeholder()) << k;
  }
}

TEST(MessageCovariance, WhatNoWheelsCanBeIsNotBelieved) {
  for (const double factor : {1e-6, 1e6}) {
    ExpectNone(Rates([&](int k) { return Matrices{{}, factor * TwistOf(k)}; }), "of the twist");
    const Eigen::Matrix3d Q = factor * Eigen::Matrix3d(Diagonal(1e-6, 1e-6, 1e-6).asDiagonal());
    ExpectNone(Rates([&](int k) { return Matrices{(1000.0 + k) * Q, {}}; }), "of the pose");
  }
}

TEST(MessageCovariance, SaysNothingForWhatIsNone) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (const double value : {0.0, 1e-12, 1e-9, 1e6, 1e9, 99999.0, -1.0, nan, infinity, -infinity}) {
    const Eigen::Matrix3d all = value * Eigen::Matrix3d::Identity();
    ExpectNone(Rates([&](int) { return Matrices{all, all}; }), "all entries the same");
    for (int i = 0; i < 3; ++i) {
      Eigen::Matrix3d one = 1e-3 * Eigen::Matrix3d::Identity();
      one(i, i) = value;
      ExpectNone(Rates([&](int) { return Matrices{one, one}; }), "one bad variance");
    }
  }
  Eigen::Matrix3d indefinite = 1e-3 * Eigen::Matrix3d::Identity();
  indefinite(0, 1) = indefinite(1, 0) = 2e-3;
  ExpectNone(Rates([&](int) { return Matrices{indefinite, indefinite}; }), "indefinite");
  Eigen::Matrix3d lopsided = 1e-3 * Eigen::Matrix3d::Identity();
  lopsided(0, 1) = 5e-4;
  ExpectNone(Rates([&](int) { return Matrices{lopsided, lopsided}; }), "not symmetric");
}

TEST(MessageCovariance, AConstantPoseCovarianceOfAMovingBaseSaysNothing) {
  ExpectNone(Rates([](int) { return Matrices{0.01 * Eigen::Matrix3d::Identity(), {}}; }), "constant");
}

TEST(MessageCovariance, AStandingBaseMayGainNothing) {
  MessageCovarianceReader reader;
  const auto P = [](int k) { return Eigen::Matrix3d((100.0 + k) * 1e-6 * Eigen::Matrix3d::Identity()); };
  for (int k = 0; k < 10; ++k) reader.Rate(At(k), PoseAt(k), {P(k), {}});
  reader.Rate(At(10), PoseAt(10), {P(10), {}});
  for (int k = 11; k < 15; ++k) {
    const std::optional<Eigen::Matrix3d> rate = reader.Rate(At(k), PoseAt(10), {P(10), {}});
    ASSERT_TRUE(rate.has_value());
    EXPECT_LT(rate->norm(), 1e-9);
  }
}

TEST(MessageCovariance, OnceShrunkThePoseIsNotBelievedAgain) {
  const auto rates = Rates([](int k) {
    const double growth = k < 20 ? 100.0 + k : 50.0 + k;
    return Matrices{growth * 1e-6 * Eigen::Matrix3d::Identity(), {}};
  });
  for (std::size_t k = kEarned; k < rates.size(); ++k) EXPECT_EQ(rates[k].has_value(), k < 20) << k;
}

TEST(MessageCovariance, StampsThatDoNotAdvanceGiveNothing) {
  MessageCovarianceReader reader;
  int k = 0;
  for (; k < 10; ++k) reader.Rate(At(k), PoseAt(k), {{}, TwistOf(k)});
  EXPECT_FALSE(reader.Rate(At(k - 1), PoseAt(k), {{}, TwistOf(k)}).has_value());
  EXPECT_FALSE(reader.Rate(At(k - 3), PoseAt(k), {{}, TwistOf(k)}).has_value());
  EXPECT_TRUE(reader.Rate(At(k - 2), PoseAt(k + 1), {{}, TwistOf(k)}).has_value());
}

class ReadingsWithCovariance : public ::testing::Test {
 protected:
  static std::vector<OdometryReading> Readings(int until_measured) {
    std::vector<OdometryReading> readings;
    for (int k = 0; k <= kSteps; ++k) {
      readings.push_back({At(k), PoseAt(k)});
      if (k > 0 && k <= until_measured) readings.back().covariance_rate = StepCovariance() / kSecondsBetween;
    }
    return readings;
  }
};

TEST_F(ReadingsWithCovariance, ArePreintegratedWithIt) {
  const PlanarMotion sum = Preintegrate(Readings(kSteps), OdometryNoise());
  EXPECT_FALSE(sum.modelled);
  // What accumulates from an exact start, turned from the odometry frame into that of the first pose.
  const Eigen::Matrix3d P = Propagated(Eigen::Matrix3d::Zero()).back();
  Eigen::Matrix3d B = Eigen::Matrix3d::Identity();
  B.topLeftCorner<2, 2>() = PoseAt(0).R();
  EXPECT_LT((sum.covariance - B.transpose() * P * B).norm(), 1e-9 * P.norm());
}

TEST_F(ReadingsWithCovariance, UseTheModelWhereTheOptionsSaySo) {
  OdometryNoise noise;
  noise.message_covariance = MessageCovarianceUse::kNever;
  const PlanarMotion sum = Preintegrate(Readings(kSteps), noise);
  EXPECT_TRUE(sum.modelled);
  EXPECT_EQ(sum.covariance, Preintegrate(Readings(0), OdometryNoise()).covariance);
}

TEST_F(ReadingsWithCovariance, AreModelledWhereAPartHasNone) {
  EXPECT_TRUE(Preintegrate(Readings(kSteps / 2), OdometryNoise()).modelled);
  EXPECT_TRUE(Preintegrate(Readings(0), OdometryNoise()).modelled);
}

TEST_F(ReadingsWithCovariance, KeepItUnderTheAmclModel) {
  OdometryNoise noise;
  noise.model = OdometryNoiseModel::kAmcl;
  const PlanarMotion sum = Preintegrate(Readings(kSteps), noise);
  EXPECT_EQ(sum.covariance, Preintegrate(Readings(kSteps), OdometryNoise()).covariance);
  EXPECT_EQ(OverWholeMotion(sum, noise).covariance, sum.covariance);
}

}  // namespace
}  // namespace planar_vslam::test
