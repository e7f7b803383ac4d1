#include "findings_testing.h"
#include "planar_vslam/pipeline/wheel_check.h"

namespace planar_vslam {
namespace {

TEST_F(FindingsTest, AGoodDriveHasNone) {
  Watch(200, Always);
  report_.odometry_rejected = 5;
  report_.map_scale.wheels = ScaleMeasurement{0.012, 0.006};
  report_.map_scale.laser = ScaleMeasurement{0.0, 0.001};
  report_.map_scale.floor = ScaleMeasurement{0.014, 0.005};
  unused_["odometry stamp not increasing"] = 3;
  EXPECT_TRUE(Found().empty()) << Found().front();
}

TEST_F(FindingsTest, ACameraInABodyFrameIsNamedFirst) {
  Watch(200, Always, 110, BodyCamera());
  report_.odometry_rejected = 60;
  for (const KeyframeId id : map_.keyframes.Ids()) map_.keyframes.Edit(id).on_floor = id.value < 5;
  const std::vector<std::string> found = Found();
  ASSERT_EQ(found.size(), 3U);
  EXPECT_NE(found[0].find("body frame"), std::string::npos);
  EXPECT_NE(found[1].find("60 of 200 steps"), std::string::npos);
  EXPECT_NE(found[2].find("88 % of the keyframes stand off the floor"), std::string::npos);
}

// Where nothing that is seen fits, nothing is tracked, and the wheels are not contradicted either.

TEST_F(FindingsTest, ACameraThatHardlyConfirmsAnythingIsNamed) {
  Watch(200, Always, 110, BodyCamera());
  report_.frames = {
      {TrackingState::kInitializing, 18}, {TrackingState::kTracking, 49}, {TrackingState::kOdometry, 154}};
  std::vector<std::string> found = Found();
  ASSERT_EQ(found.size(), 2U);
  EXPECT_NE(found[0].find("body frame"), std::string::npos);
  EXPECT_NE(found[1].find("154 poses are by the wheels, 49 by sight"), std::string::npos);
  for (const KeyframeId id : map_.keyframes.Ids()) map_.keyframes.Edit(id).on_floor = id.value < 5;
  EXPECT_EQ(Found().size(), 3U);
  report_.keyframes_made = 0;  // localised in a map of another way
  EXPECT_EQ(Found().size(), 2U);
  report_.keyframes_made = 1;
  watch_ = InputWatch();
  Watch(200, Always);
  report_.frames[TrackingState::kTracking] = 180;
  EXPECT_TRUE(Found().empty()) << "some of the way without texture is no fault";
}

TEST_F(FindingsTest, ARollingShutterIsNamed) {
  Watch(200, Always);
  report_.missed_readout = Deviation{0.006, 0.0005};
  ExpectOne({"rolling shutter", "6 ms or more", "image_timing.readout"});
  report_.missed_readout = Deviation{0.006, 0.002};
  EXPECT_TRUE(Found().empty()) << "not sure";
  report_.missed_readout = Deviation{0.002, 0.0001};
  EXPECT_TRUE(Found().empty()) << "bends nothing";
  report_.missed_readout = Deviation{-0.006, 0.0005};
  ExpectOne({"last to first", "-0.03 to -0.01"});
}

TEST_F(FindingsTest, ARampIsNoFault) {
  Watch(200, Always);
  for (const KeyframeId id : map_.keyframes.Ids()) map_.keyframes.Edit(id).on_floor = id.value < 5;
  report_.map_scale.laser = ScaleMeasurement{0.0, 0.001};
  report_.map_scale.floor = ScaleMeasurement{0.05, 0.005};
  EXPECT_TRUE(Found().empty()) << Found().front();
}

TEST_F(FindingsTest, ACameraThatLooksAtTheCeilingIsFineWhereNothingContradictsIt) {
  Watch(200, Always, 110, BodyCamera());
  EXPECT_TRUE(Found().empty());
}

TEST_F(FindingsTest, WheelsThatReadWrongAreNamed) {
  Watch(200, Always);
  map_ =
      Drive([](const Rigid2& step) { return Rigid2(step.translation.x(), step.translation.y(), 1.06 * step.angle); });
  ExpectOne({"turn", "too far", "calibrate"});
  map_ =
      Drive([](const Rigid2& step) { return Rigid2(step.translation.x(), step.translation.y(), 0.94 * step.angle); });
  ExpectOne({"too little"});
  map_ = Drive([](const Rigid2& step) {
    const Eigen::Vector2d askew = Rigid2(0.0, 0.0, DegreesToRadians(4.0)).R() * step.translation;
    return Rigid2(askew.x(), askew.y(), step.angle);
  });
  ExpectOne({"deg left", "yaw of the camera", "calibrate"});
  map_ = Drive([](const Rigid2& step) { return Rigid2(-step.translation.x(), -step.translation.y(), step.angle); });
  ExpectOne({"backwards"});
}

TEST_F(FindingsTest, WheelsThatReadWrongAreNamedThoughTheMapHasLearnedIt) {
  Watch(200, Always);
  map_ = Drive([](const Rigid2& step) { return step; });
  report_.wheels.log_turn = -0.05;
  ExpectOne({"turn", "5.0 % too far", "calibrate"});
  report_.wheels.log_turn = 0.0;
  report_.wheels.log_length = -0.03;
  report_.map_scale.wheels = ScaleMeasurement{0.0, 0.005};
  report_.map_scale.laser = ScaleMeasurement{0.0, 0.001};
  ExpectOne({"the wheels", "3.0 % larger", "the laser", "calibrate"});
}

TEST_F(FindingsTest, AYawOfTheCameraThatAnAdjustmentFoundIsNamed) {
  Watch(200, Always);
  FindingsInput input{report_, watch_, &map_};
  input.motion.direction = Deviation{DegreesToRadians(-0.9), DegreesToRadians(0.1)};
  ASSERT_EQ(Findings(input).size(), 1U) << "by the wheels' direction";
  input.yaw = Deviation{DegreesToRadians(1.9), DegreesToRadians(0.1)};
  ASSERT_EQ(Findings(input).size(), 1U);
  EXPECT_NE(Findings(input)[0].find("off by 1.9 deg or more: it looks further to the left"), std::string::npos);
  input.yaw = Deviation{DegreesToRadians(1.9), DegreesToRadians(0.5)};
  EXPECT_TRUE(Findings(input).empty()) << "not sure: " << Findings(input)[0];
  input.yaw = Deviation{DegreesToRadians(1.9), DegreesToRadians(0.1)};
  input.motion.time_offset = Deviation{0.5, 0.005};
  ASSERT_EQ(Findings(input).size(), 1U);
  EXPECT_NE(Findings(input)[0].find("500 ms"), std::string::npos) << "the clock bends the yaw, too";
}

TEST_F(FindingsTest, OdometryWithoutOrientationIsNamed) {
  Watch(200, Always);
  map_ = Drive([](const Rigid2& step) { return Rigid2(step.translation.x(), step.translation.y(), 0.0); });
  ExpectOne({"never turn", "orientation"});
}

TEST_F(FindingsTest, SourcesOfScaleThatDisagreeAreNamedWithTheBelievedOne) {
  Watch(200, Always);
  report_.map_scale.wheels = ScaleMeasurement{-0.03, 0.005};
  report_.map_scale.laser = ScaleMeasurement{0.0, 0.001};
  ExpectOne({"the wheels", "3.0 % smaller", "the laser", "calibrate"});
  report_.map_scale.wheels.reset();
  report_.map_scale.floor = ScaleMeasurement{0.05, 0.005};
  ExpectOne({"height over the floor", "5.0 % larger", "the laser", "height in tf"});
  report_.map_scale.wheels = ScaleMeasurement{0.045, 0.01};
  ExpectOne({"height over the floor (and the wheels)", "5.0 % larger", "the laser's ranges"});
}

// What is seen where the base itself has been is floor.
TEST_F(FindingsTest, AHeightOfTheCameraThatIsWrongIsNamed) {
  Watch(200, Always);
  const auto put_floor = [this](double level, double scatter) {
    map_.landmarks = {};
    std::mt19937 generator(2);
    std::normal_distribution<double> off(0.0, scatter);
    std::uint32_t next = 0;
    for (const auto& [id, keyframe] : map_.keyframes) {
      Landmark on_way, wall;
      on_way.observations.resize(3);
      wall.observations.resize(3);
      on_way.p_map = keyframe.T_map_base.translation + Eigen::Vector3d(0.05, 0.05, level + off(generator));
      wall.p_map = keyframe.T_map_base.translation + Eigen::Vector3d(5.0, 5.0, 0.08);
      map_.landmarks.Insert(LandmarkId{next++}, on_way);
      map_.landmarks.Insert(LandmarkId{next++}, wall);
    }
  };
  put_floor(-0.1, 0.01);
  report_.map_scale.laser = ScaleMeasurement{0.0, 0.001};
  report_.map_scale.floor = ScaleMeasurement{-0.1, 0.005};
  ExpectOne({"10 cm below", "about 1.10 m over the floor, not 1.00", "tf"});
  report_.map_scale.floor.reset();
  put_floor(0.06, 0.01);
  ExpectOne({"6 cm above", "about 0.94 m"});
  put_floor(0.01, 0.01);
  EXPECT_TRUE(Found().empty()) << Found().front();
  put_floor(0.1, 0.15);
  EXPECT_TRUE(Found().empty()) << "that is no floor: " << Found().front();
}

TEST_F(FindingsTest, ALaserThatNeverAgreesIsNamed) {
  Watch(200, Always);
  has_laser_ = true;
  EXPECT_TRUE(Found().empty()) << "no sweep came in, which is said elsewhere";
  WatchSweeps();
  ExpectOne({"laser"});
}

TEST_F(FindingsTest, ALaserThatIsNotMatchedIsNotBlamed) {
  Watch(200, Always);
  WatchSweeps();
  FindingsInput input{report_, watch_, &map_};
  input.has_laser = true;
  input.laser_is_matched = false;
  EXPECT_TRUE(Findings(input).empty());
}

TEST_F(FindingsTest, OdometryThatNeverMovesIsNamedWhereNoMapCame) {
  Watch(200, Always, 110, ForwardCamera(), 0.0);
  EXPECT_TRUE(Found().empty()) << Found().front();
  with_map_ = false;
  ExpectOne({"odometry never moved", "init=visual"});
}

// What a clock that is far off spoils is not blamed on mount and wheels.

TEST_F(FindingsTest, WhatIsSetAlreadyIsNotAdvised) {
  Watch(200, Always);
  FindingsInput input{report_, watch_};
  ASSERT_EQ(Findings(input).size(), 1U);
  EXPECT_NE(Findings(input)[0].find("init=visual"), std::string::npos);
  input.starts_by_images = true;
  ASSERT_EQ(Findings(input).size(), 1U);
  EXPECT_EQ(Findings(input)[0].find("init=visual"), std::string::npos);
  EXPECT_NE(Findings(input)[0].find("camera_info"), std::string::npos);
}

TEST_F(FindingsTest, NoMapSaysWhatMayBeWrong) {
  Watch(200, Always);
  with_map_ = false;
  ExpectOne({"no map", "init=visual"});
  unused_["image waited for odometry in vain"] = 150;
  const std::vector<std::string> found = Found();
  ASSERT_FALSE(found.empty());
  EXPECT_NE(found[0].find("clocks of two computers"), std::string::npos) << "not the wheels' fault: " << found[0];
}

TEST(WheelCheckTest, SaysNothingOfAFewSteps) {
  const WheelCheck check = CheckWheels(Map());
  EXPECT_FALSE(check.turn.has_value() || check.direction.has_value());
}

}  // namespace
}  // namespace planar_vslam
