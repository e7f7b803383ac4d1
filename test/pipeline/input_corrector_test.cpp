#include "planar_vslam/pipeline/input_corrector.h"

#include <gtest/gtest.h>

namespace planar_vslam {
namespace {

TEST(InputCorrector, LeavesEverythingAsItIsWithoutACalibration) {
  InputCorrector corrector{SensorCorrection{}};
  const OdometryReading reading{Timestamp::FromSeconds(1.0), Rigid2({1.0, 2.0}, 0.3)};
  const OdometryReading corrected = corrector.Correct(reading);
  EXPECT_EQ(corrected.stamp, reading.stamp);
  EXPECT_LT(LogSe2(corrected.T_odom_base.Inverse() * reading.T_odom_base).norm(), 1e-12);
  const Rigid3 mount(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.1, 0.0, 1.0));
  EXPECT_LT(LogSe3(corrector.Correct(CameraFrame{{}, mount}).T_base_camera.Inverse() * mount).norm(), 1e-12);
}

TEST(InputCorrector, WheelsAreScaledStepByStep) {
  SensorCorrection correction;
  correction.odometry.scale = Eigen::Vector3d(1.1, 1.0, 1.0);
  InputCorrector corrector(correction);
  const Rigid2 start({5.0, 0.0}, 0.0);  // where odometry happens to begin is no motion
  const Rigid2 first = corrector.Correct(OdometryReading{Timestamp::FromSeconds(0.0), start}).T_odom_base;
  Rigid2 last;
  for (int i = 1; i <= 10; ++i) {
    const Rigid2 T_odom_base({5.0 + 0.1 * i, 0.0}, 0.0);
    last = corrector.Correct(OdometryReading{Timestamp::FromSeconds(0.1 * i), T_odom_base}).T_odom_base;
  }
  EXPECT_NEAR((first.Inverse() * last).translation.x(), 1.1, 1e-9);
}

TEST(InputCorrector, EverythingButImagesGoesOntoTheCamerasClock) {
  SensorCorrection correction;
  correction.odometry.time_offset = 0.05;  // s, the others' clock minus the camera's
  InputCorrector corrector(correction);
  const Timestamp stamp = Timestamp::FromSeconds(1.0), on_camera_clock = Timestamp::FromSeconds(0.95);
  EXPECT_EQ(corrector.Correct(OdometryReading{stamp, Rigid2()}).stamp, on_camera_clock);
  LaserFrame laser;
  laser.scan.stamp = stamp;
  EXPECT_EQ(corrector.Correct(laser).scan.stamp, on_camera_clock);
  CameraFrame frame;
  frame.image.stamp = stamp;
  EXPECT_EQ(corrector.Correct(frame).image.stamp, stamp);
}

TEST(InputCorrector, TheCameraIsWhereItWasFoundToBe) {
  SensorCorrection correction;
  correction.camera_mount << 0.02, 0.0, 0.0, 0.0, 0.0, DegreesToRadians(2.0);
  InputCorrector corrector(correction);
  CameraFrame frame;
  frame.T_base_camera = Rigid3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.1, 0.0, 1.0));
  const Rigid3 corrected = corrector.Correct(frame).T_base_camera;
  EXPECT_NEAR(corrected.translation.x(), 0.12, 1e-9);
  EXPECT_NEAR(LogSo3(corrected.rotation).z(), DegreesToRadians(2.0), 1e-9);
}

}  // namespace
}  // namespace planar_vslam
