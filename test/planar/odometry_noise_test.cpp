#include "planar_vslam/planar/odometry_noise.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <limits>
#include <random>

#include "planar_vslam/planar/preintegration.h"

namespace planar_vslam::test {
namespace {

struct Field {
  const char* name;
  double OdometryNoise::*member;
  bool zero_allowed;
};

constexpr Field kFields[] = {
    {"along_per_sqrt_meter", &OdometryNoise::along_per_sqrt_meter, true},
    {"across_per_sqrt_meter", &OdometryNoise::across_per_sqrt_meter, true},
    {"across_per_sqrt_radian", &OdometryNoise::across_per_sqrt_radian, true},
    {"heading_per_sqrt_meter_deg", &OdometryNoise::heading_per_sqrt_meter, true},
    {"heading_per_sqrt_radian", &OdometryNoise::heading_per_sqrt_radian, true},
    {"amcl_alpha1", &OdometryNoise::amcl_alpha1, true},
    {"amcl_alpha2", &OdometryNoise::amcl_alpha2, true},
    {"amcl_alpha3", &OdometryNoise::amcl_alpha3, true},
    {"amcl_alpha4", &OdometryNoise::amcl_alpha4, true},
    {"position_floor", &OdometryNoise::position_floor, false},
    {"heading_floor_deg", &OdometryNoise::heading_floor, false},
    {"height_per_sqrt_meter", &OdometryNoise::height_per_sqrt_meter, true},
    {"height_floor", &OdometryNoise::height_floor, false},
    {"tilt_per_sqrt_meter_deg", &OdometryNoise::tilt_per_sqrt_meter, true},
    {"tilt_floor_deg", &OdometryNoise::tilt_floor, false},
};

TEST(OdometryNoise, DefaultsAreGood) { EXPECT_TRUE(OdometryNoise().Problems().empty()); }

TEST(OdometryNoise, NamesEachBadField) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (const Field& field : kFields) {
    for (const double value : {0.0, -0.01, nan, infinity, -infinity}) {
      OdometryNoise noise;
      noise.*field.member = value;
      const std::vector<std::string> problems = noise.Problems();
      if (value == 0.0 && field.zero_allowed) {
        EXPECT_TRUE(problems.empty()) << field.name;
        continue;
      }
      ASSERT_EQ(problems.size(), 1u) << field.name << " = " << value;
      EXPECT_EQ(problems[0].rfind(std::string(field.name) + " is ", 0), 0u) << problems[0];
    }
  }
}

TEST(OdometryNoise, NamesAllBadFieldsAtOnce) {
  OdometryNoise noise;
  for (const Field& field : kFields) noise.*field.member = -1.0;
  EXPECT_EQ(noise.Problems().size(), std::size(kFields));
}

TEST(IncrementCovariance, FollowsTheModel) {
  const OdometryNoise noise;
  const Eigen::Matrix3d straight = IncrementCovariance(noise, Rigid2(1.0, 0.0, 0.0));
  EXPECT_NEAR(std::sqrt(straight(0, 0)), noise.along_per_sqrt_meter, 1e-12);
  EXPECT_NEAR(std::sqrt(straight(1, 1)), noise.across_per_sqrt_meter, 1e-12);
  EXPECT_NEAR(std::sqrt(straight(2, 2)), noise.heading_per_sqrt_meter, 1e-12);
  const Eigen::Matrix3d turn = IncrementCovariance(noise, Rigid2(0.0, 0.0, -1.0));
  EXPECT_EQ(turn(0, 0), 0.0);
  EXPECT_NEAR(std::sqrt(turn(1, 1)), noise.across_per_sqrt_radian, 1e-12);
  EXPECT_NEAR(std::sqrt(turn(2, 2)), noise.heading_per_sqrt_radian, 1e-12);
}

TEST(IncrementCovariance, VariancesGrowWithDistanceAndTurn) {
  const OdometryNoise noise;
  const Eigen::Matrix3d once = IncrementCovariance(noise, Rigid2(0.1, -0.05, 0.2));
  const Eigen::Matrix3d twice = IncrementCovariance(noise, Rigid2(0.2, -0.1, 0.4));
  EXPECT_LT((twice - 2.0 * once).norm(), 1e-12);
  EXPECT_LT((once - IncrementCovariance(noise, Rigid2(0.1, -0.05, -0.2))).norm(), 1e-15);
  EXPECT_EQ(IncrementCovariance(noise, Rigid2()), Eigen::Matrix3d::Zero());
}

class AmclModel : public ::testing::Test {
 protected:
  AmclModel() {
    noise_.model = OdometryNoiseModel::kAmcl;
    noise_.amcl_alpha1 = 0.04;
    noise_.amcl_alpha2 = 0.01;
    noise_.amcl_alpha3 = 0.02;
    noise_.amcl_alpha4 = 0.03;
  }
  Eigen::Matrix3d Covariance(double x, double y, double angle) const {
    return IncrementCovariance(noise_, Rigid2(x, y, angle));
  }
  OdometryNoise noise_;
};

TEST_F(AmclModel, IsSymmetricAndPositiveDefiniteWithTheFloors) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> way(-1.0, 1.0), angle(-M_PI, M_PI);
  for (int k = 0; k < 500; ++k) {
    const double reach = k % 3 == 0 ? 0.005 : 1.0;  // also under the centimetre
    PlanarMotion odometry;
    odometry.T_i_j = Rigid2(reach * way(generator), reach * way(generator), angle(generator));
    odometry.covariance = IncrementCovariance(noise_, odometry.T_i_j);
    EXPECT_LT((odometry.covariance - odometry.covariance.transpose()).norm(), 1e-12);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> bare(odometry.covariance);
    EXPECT_GT(bare.eigenvalues().minCoeff(), -1e-12);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> floored(CovarianceWithFloor(odometry, noise_));
    EXPECT_GT(floored.eigenvalues().minCoeff(), 0.0);
  }
}

TEST_F(AmclModel, TurningOnTheSpotErrsInHeadingAndWay) {
  for (const double turn : {0.3, -0.3, 3.0, M_PI, -M_PI}) {
    const Eigen::Matrix3d C = Covariance(0.0, 0.0, turn);
    EXPECT_NEAR(C(0, 0), noise_.amcl_alpha4 * turn * turn, 1e-12);
    EXPECT_NEAR(C(2, 2), noise_.amcl_alpha1 * turn * turn, 1e-12);
    EXPECT_NEAR(C(1, 1), 0.0, 1e-12);
  }
}

TEST_F(AmclModel, DrivingStraightErrsAlongAndSwings) {
  const Eigen::Matrix3d C = Covariance(0.5, 0.0, 0.0);
  EXPECT_NEAR(C(0, 0), noise_.amcl_alpha3 * 0.25, 1e-12);
  EXPECT_NEAR(C(1, 1), 0.25 * noise_.amcl_alpha2 * 0.25, 1e-12);  // the first turn's error times the way
  EXPECT_NEAR(C(2, 2), 2.0 * noise_.amcl_alpha2 * 0.25, 1e-12);   // both turns'
  EXPECT_NEAR(C(1, 2), 0.5 * noise_.amcl_alpha2 * 0.25, 1e-12);
}

TEST_F(AmclModel, FollowsTheSampledMotion) {
  std::mt19937 generator(2);
  std::normal_distribution<double> normal;
  noise_.amcl_alpha1 = noise_.amcl_alpha2 = noise_.amcl_alpha3 = noise_.amcl_alpha4 = 1e-3;
  const double rot1 = 0.4, trans = 0.6, rot2 = -0.7;
  const Rigid2 motion(trans * std::cos(rot1), trans * std::sin(rot1), rot1 + rot2);
  const double s1 = std::sqrt(1e-3 * (rot1 * rot1 + trans * trans));
  const double st = std::sqrt(1e-3 * (trans * trans + rot1 * rot1 + rot2 * rot2));
  const double s2 = std::sqrt(1e-3 * (rot2 * rot2 + trans * trans));
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  constexpr int kDraws = 20000;
  for (int k = 0; k < kDraws; ++k) {
    const double r1 = rot1 + s1 * normal(generator), t = trans + st * normal(generator);
    const Rigid2 drawn(t * std::cos(r1), t * std::sin(r1), r1 + rot2 + s2 * normal(generator));
    const Eigen::Vector3d d(drawn.translation.x() - motion.translation.x(),
                            drawn.translation.y() - motion.translation.y(), WrapAngle(drawn.angle - motion.angle));
    sum += d * d.transpose();
  }
  const Eigen::Matrix3d C = IncrementCovariance(noise_, motion);
  EXPECT_LT((sum / kDraws - C).norm(), 0.05 * C.norm());
}

TEST_F(AmclModel, BackwardsErrsAsForwards) {
  const Eigen::Matrix3d ahead = Covariance(0.5, 0.0, 0.1), back = Covariance(-0.5, 0.0, 0.1);
  EXPECT_LT((ahead.diagonal() - back.diagonal()).norm(), 1e-12);
  EXPECT_NEAR(ahead(1, 2), -back(1, 2), 1e-12);  // the same swing to the other side
  // On either side of straight back, where atan2 jumps.
  EXPECT_LT((Covariance(-0.5, 1e-9, 0.1) - Covariance(-0.5, -1e-9, 0.1)).norm(), 1e-9);
}

TEST_F(AmclModel, HeadingsMeetAtTheSeam) {
  EXPECT_LT((Covariance(0.3, 0.1, M_PI - 1e-9) - Covariance(0.3, 0.1, -M_PI + 1e-9)).norm(), 1e-6);
  EXPECT_LT((Covariance(0.0, 0.0, M_PI - 1e-9) - Covariance(0.0, 0.0, -M_PI + 1e-9)).norm(), 1e-6);
}

TEST_F(AmclModel, AShortWayHasNoDirection) {
  const Eigen::Matrix3d C = Covariance(0.0, 0.009, 0.0);  // sideways: would be a quarter turn and back
  EXPECT_LT(C.diagonal().maxCoeff(), 1e-4);
  EXPECT_GT(Covariance(0.0, 0.011, 0.0)(2, 2), 0.1);
}

class AmclOverAWay : public AmclModel {
 protected:
  static std::vector<OdometryReading> Readings(int count) {
    std::vector<OdometryReading> readings;
    for (int k = 0; k <= count; ++k) {
      readings.push_back({Timestamp{1000000000LL * k / count},
                          Rigid2(2.0, 1.0, 3.0) * ExpSe2(Eigen::Vector3d(0.4, 0.0, 0.3) * k / count)});
    }
    return readings;
  }
};

TEST_F(AmclOverAWay, DoesNotDependOnTheRateOfReadingsOrFrames) {
  const Eigen::Matrix3d coarse = Preintegrate(Readings(2), noise_).covariance;
  EXPECT_LT((Preintegrate(Readings(100), noise_).covariance - coarse).norm(), 1e-12);
  // Frame by frame, then made the link of a keyframe.
  PlanarMotion frames;
  const std::vector<OdometryReading> readings = Readings(40);
  for (std::size_t k = 0; k + 4 < readings.size(); k += 4) {
    frames = Compose(frames, Preintegrate({readings.begin() + static_cast<std::ptrdiff_t>(k),
                                           readings.begin() + static_cast<std::ptrdiff_t>(k + 5)},
                                          noise_));
  }
  EXPECT_LT(frames.covariance(0, 0), 0.5 * coarse(0, 0)) << "quadratic variances of parts do not add up";
  EXPECT_LT((OverWholeMotion(frames, noise_).covariance - coarse).norm(), 1e-12);
}

TEST_F(AmclOverAWay, LinksOfKeyframesComposeAsAny) {
  const std::vector<OdometryReading> readings = Readings(40);
  const PlanarMotion ij = Preintegrate({readings.begin(), readings.begin() + 21}, noise_);
  const PlanarMotion jk = Preintegrate({readings.begin() + 20, readings.end()}, noise_);
  const PlanarMotion ik = Compose(ij, jk);
  EXPECT_LT((ik.T_i_j.translation - Preintegrate(readings, noise_).T_i_j.translation).norm(), 1e-12);
  Eigen::Matrix3d A = Eigen::Matrix3d::Identity(), B = A;
  const Eigen::Vector2d r = ij.T_i_j.R() * jk.T_i_j.translation;
  A(0, 2) = -r.y();
  A(1, 2) = r.x();
  B.topLeftCorner<2, 2>() = ij.T_i_j.R();
  EXPECT_LT((ik.covariance - A * ij.covariance * A.transpose() - B * jk.covariance * B.transpose()).norm(), 1e-15);
}

TEST(OverWholeMotion, LeavesTheArcLengthModelAlone) {
  PlanarMotion odometry;
  odometry.T_i_j = Rigid2(1.0, 0.0, 0.0);
  odometry.covariance = 7.0 * Eigen::Matrix3d::Identity();
  odometry.modelled = true;
  EXPECT_EQ(OverWholeMotion(odometry, OdometryNoise()).covariance, odometry.covariance);
}

}  // namespace
}  // namespace planar_vslam::test
