// Calibration of a small known world whose wheels, camera mount and map are exact, from readings and mounts that are
// not.
#include "planar_vslam/optimize/calibration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "planar_vslam/optimize/mounted_reprojection_factor.h"
#include "support/synthetic_map.h"

namespace planar_vslam::test {
namespace {

constexpr double kSpeed = 0.5;    // m/s along the path
constexpr double kPeriod = 0.02;  // s between readings
constexpr int kKeyframes = 16;

const CalibratedValue& Value(const CalibrationResult& result, const std::string& name) {
  for (const CalibratedValue& value : result.values) {
    if (value.name == name) return value;
  }
  ADD_FAILURE() << name;
  return result.values.front();
}

class CalibrationTest : public ::testing::Test {
 protected:
  CalibrationTest() {
    SyntheticWorldOptions options;
    options.keyframes = kKeyframes;
    options.points = 500;
    options.pixel_noise = 0.3;
    world_ = MakeSyntheticWorld(options);
    context_ = world_.Context();
    map_ = world_.map;
    double x = 0.0;
    std::optional<KeyframeId> previous;
    for (const KeyframeId id : map_.keyframes.Ids()) {
      Keyframe& keyframe = map_.keyframes.Edit(id);
      keyframe.stamp = Stamp(x / kSpeed);
      // The laser measured the way from the keyframe before, in metres.
      if (previous.has_value()) keyframe.laser_links = {{*previous, keyframe.odometry_link->motion}};
      for (MotionLink& link : keyframe.laser_links) link.motion.covariance = 1e-6 * Eigen::Matrix3d::Identity();
      previous = id;
      x += options.step;
    }
  }

  static Timestamp Stamp(double seconds) { return Timestamp::FromSeconds(50.0 + seconds); }
  // What wheels that read `scale` times the truth say of the path.
  static std::vector<OdometryReading> Readings(const Eigen::Vector3d& scale) {
    std::vector<OdometryReading> readings;
    Rigid2 T_odom_base;
    const auto place = [](int k) { return ProjectToPlane(SyntheticPose(kSpeed * k * kPeriod)); };
    for (int k = -50; k < 800; ++k) {
      readings.push_back({Stamp(k * kPeriod), T_odom_base});
      T_odom_base = T_odom_base * ExpSe2(scale.cwiseProduct(LogSe2(place(k).Inverse() * place(k + 1))));
    }
    return readings;
  }
  Expected<CalibrationResult> Calibrate(const std::vector<OdometryReading>& readings,
                                        const CalibrationOptions& options = {}) const {
    return CalibrateMap(map_, readings, SensorCorrection{}, context_, options);
  }
  // The keyframes claim a camera turned by this against where it is.
  void TurnMounts(const Vector6d& error) {
    for (const KeyframeId id : map_.keyframes.Ids()) {
      Keyframe& keyframe = map_.keyframes.Edit(id);
      keyframe.T_base_camera = Mounted(error, keyframe.T_base_camera);
    }
  }

  // Every image was taken by a camera turned at random against where its keyframe says it is.
  void SwayMounts(double sigma, std::uint32_t seed) {
    std::mt19937 generator(seed);
    std::normal_distribution<double> normal(0.0, sigma);
    for (const KeyframeId id : map_.keyframes.Ids()) {
      Keyframe& keyframe = map_.keyframes.Edit(id);
      const Eigen::Vector3d turn(normal(generator), normal(generator), normal(generator));
      keyframe.T_base_camera = world_.T_base_camera * Rigid3(ExpSo3(turn), Eigen::Vector3d::Zero());
    }
  }

  SyntheticWorld world_;
  MeasurementModel context_;
  Map map_;
};

TEST_F(CalibrationTest, NothingIsCorrectedWhereNothingIsWrong) {
  const Expected<CalibrationResult> result = Calibrate(Readings(Eigen::Vector3d::Ones()));
  ASSERT_TRUE(result.ok()) << result.error().message;
  for (const CalibratedValue& v : result->values) {
    const double nothing = v.name.rfind("odometry_scale", 0) == 0 ? 1.0 : 0.0;
    EXPECT_LT(std::abs(v.value - nothing), 3.0 * v.sigma + 1e-6) << v.name;
  }
}

TEST_F(CalibrationTest, FindsTheWheelsScale) {
  const Expected<CalibrationResult> result = Calibrate(Readings({1.02, 1.02, 1.03}));
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_TRUE(Value(*result, "odometry_scale_x").observed);
  EXPECT_NEAR(result->correction.odometry.scale.x(), 1.0 / 1.02, 0.003);
  const CalibratedValue yaw = Value(*result, "odometry_scale_yaw");
  EXPECT_LT(std::abs(yaw.value - 1.0 / 1.03), 3.0 * yaw.sigma);
}

TEST_F(CalibrationTest, FindsHowTheCameraIsTurned) {
  Vector6d error = Vector6d::Zero();
  error.tail<3>() << DegreesToRadians(0.5), DegreesToRadians(-0.7), DegreesToRadians(2.0);
  TurnMounts(error);
  const Expected<CalibrationResult> result = Calibrate(Readings(Eigen::Vector3d::Ones()));
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_TRUE(Value(*result, "camera_yaw").observed);
  const Eigen::Quaterniond left =
      ExpSo3(result->correction.camera_mount.tail<3>()) * ExpSo3(Eigen::Vector3d(error.tail<3>()));
  EXPECT_LT(LogSo3(left).norm(), DegreesToRadians(0.2));
}

TEST_F(CalibrationTest, ItsSigmasCoverWhatASwayingCameraDoes) {
  constexpr double kSway = DegreesToRadians(0.16);
  CalibrationOptions rigid;
  rigid.camera_sway_sigma = 0.01 * kSway;
  for (double* known : {&context_.odometry_noise.heading_floor, &context_.odometry_noise.heading_per_sqrt_meter,
                        &context_.odometry_noise.heading_per_sqrt_radian, &context_.odometry_noise.tilt_floor,
                        &context_.odometry_noise.tilt_per_sqrt_meter}) {
    *known = DegreesToRadians(0.02);  // the wheels turn as they say, the floor is flat
  }
  double swaying_squared = 0.0, rigid_squared = 0.0;  // of errors over their sigmas
  constexpr int kDraws = 3;
  for (std::uint32_t draw = 0; draw < kDraws; ++draw) {
    SwayMounts(kSway, draw + 1);
    const auto add = [&](const CalibrationOptions& options, double* sum) {
      const Expected<CalibrationResult> result = Calibrate(Readings(Eigen::Vector3d::Ones()), options);
      ASSERT_TRUE(result.ok()) << result.error().message;
      for (const char* name : {"camera_roll", "camera_pitch", "camera_yaw"}) {
        const CalibratedValue angle = Value(*result, name);
        *sum += std::pow(angle.value / angle.sigma, 2);
      }
    };
    add(CalibrationOptions{}, &swaying_squared);
    add(rigid, &rigid_squared);
  }
  EXPECT_LT(swaying_squared / (3 * kDraws), 2.0);  // 1, of a chi-square
  EXPECT_GT(rigid_squared / (3 * kDraws), 4.0);
}

TEST_F(CalibrationTest, WhatADriveDoesNotShowStaysAsItWas) {
  for (const KeyframeId id : map_.keyframes.Ids()) {
    Keyframe& keyframe = map_.keyframes.Edit(id);
    keyframe.laser_links.clear();  // nothing else knows metres
  }
  const Expected<CalibrationResult> result = Calibrate(Readings({1.02, 1.02, 1.0}));
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_FALSE(Value(*result, "odometry_scale_x").observed);
  EXPECT_EQ(result->correction.odometry.scale.x(), 1.0);
}

TEST_F(CalibrationTest, AMapWithoutScaleIsRefused) {
  map_.metric = false;
  const Expected<CalibrationResult> result = Calibrate(Readings(Eigen::Vector3d::Ones()));
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().message.find("metric"), std::string::npos);
}

TEST(SensorCorrection, NamesEveryProblem) {
  EXPECT_TRUE(SensorCorrection{}.Problems().empty());
  SensorCorrection correction;
  correction.odometry.scale.y() = 0.0;
  correction.odometry.time_offset = std::nan("");
  correction.camera_mount[2] = std::nan("");
  EXPECT_EQ(correction.Problems().size(), 3U);
}

}  // namespace
}  // namespace planar_vslam::test
