#include "planar_vslam/planar/odometry_noise.h"

#include <gtest/gtest.h>

#include <limits>

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
    {"heading_per_sqrt_meter", &OdometryNoise::heading_per_sqrt_meter, true},
    {"heading_per_sqrt_radian", &OdometryNoise::heading_per_sqrt_radian, true},
    {"position_floor", &OdometryNoise::position_floor, false},
    {"heading_floor", &OdometryNoise::heading_floor, false},
    {"height_per_sqrt_meter", &OdometryNoise::height_per_sqrt_meter, true},
    {"height_floor", &OdometryNoise::height_floor, false},
    {"tilt_per_sqrt_meter", &OdometryNoise::tilt_per_sqrt_meter, true},
    {"tilt_floor", &OdometryNoise::tilt_floor, false},
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
      EXPECT_EQ(problems[0].rfind(std::string(field.name) + ": expected ", 0), 0u) << problems[0];
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

}  // namespace
}  // namespace planar_vslam::test
