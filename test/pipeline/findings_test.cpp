#include "planar_vslam/pipeline/findings.h"

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <random>

#include "planar_vslam/pipeline/wheel_check.h"

namespace planar_vslam {
namespace {

constexpr double kPeriod = 0.1;  // s between images
constexpr int kKeyframes = 40;

// A camera that looks forward: z along x of the base.
Rigid3 ForwardCamera() {
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {Eigen::Quaterniond(R), Eigen::Vector3d(0.1, 0.0, 1.0)};
}

CameraFrame Image(double t, std::uint8_t grey, const Rigid3& T_base_camera) {
  CameraFrame frame;
  frame.image.stamp = Timestamp::FromSeconds(t);
  frame.image.image = {64, 48, std::make_shared<const std::vector<std::uint8_t>>(64 * 48, grey)};
  frame.T_base_camera = T_base_camera;
  return frame;
}

// Keyframes along a curve, and wheels whose steps are `read` of the true ones.
Map Drive(const std::function<Rigid2(const Rigid2&)>& read) {
  Map map;
  map.metric = true;
  std::mt19937 generator(1);
  std::normal_distribution<double> noise(0.0, 0.002);
  Rigid2 T_map_base;
  for (std::uint32_t k = 0; k < kKeyframes; ++k) {
    Keyframe keyframe;
    const Rigid2 step = ExpSe2(Eigen::Vector3d(0.15, 0.01, k % 20 < 10 ? 0.15 : -0.1));
    if (k > 0) {
      T_map_base = T_map_base * step;
      MotionLink link;
      link.from = KeyframeId{k - 1};
      link.motion.T_i_j = read(step) * Rigid2(noise(generator), noise(generator), noise(generator));
      keyframe.odometry_link = link;
    }
    keyframe.T_map_base = Embed3(T_map_base);
    map.keyframes.Insert(KeyframeId{k}, keyframe);
  }
  return map;
}

Rigid2 AsItWas(const Rigid2& step) { return step; }

class FindingsTest : public ::testing::Test {
 protected:
  FindingsTest() : map_(Drive(AsItWas)) {
    report_.odometry_by_model = 200;
    report_.keyframes_made = static_cast<long>(map_.keyframes.size());
  }

  void Watch(int images, const std::function<bool(int)>& arrives, std::uint8_t grey = 110,
             const Rigid3& T_base_camera = ForwardCamera(), double speed = 0.5) {
    for (int i = 0; i < images; ++i) {
      const double t = kPeriod * i;
      watch_.Add(OdometryReading{Timestamp::FromSeconds(t), Rigid2(speed * t, 0.0, 0.0)});
      if (arrives(i)) watch_.Add(Image(t, grey, T_base_camera));
    }
  }
  void WatchSweeps() {
    for (int i = 0; i < 50; ++i) {
      LaserFrame frame;
      frame.scan.stamp = Timestamp::FromSeconds(kPeriod * i);
      watch_.Add(frame);
    }
  }
  std::vector<std::string> Found() const {
    FindingsInput input{report_, watch_, with_map_ ? &map_ : nullptr, unused_, notes_, true, has_laser_};
    return Findings(input);
  }
  void ExpectOne(const std::vector<std::string>& parts) const {
    const std::vector<std::string> found = Found();
    ASSERT_EQ(found.size(), 1U) << (found.empty() ? "nothing" : found[1 % found.size()]);
    for (const std::string& part : parts) EXPECT_NE(found[0].find(part), std::string::npos) << part << ": " << found[0];
  }

  static bool Always(int) { return true; }

  EstimatorReport report_;
  InputWatch watch_;
  Map map_;
  bool with_map_ = true, has_laser_ = false;
  std::map<std::string, long> unused_;
  std::vector<std::string> notes_;
};

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
  Watch(200, Always, 110, Rigid3());
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
  Watch(200, Always, 110, Rigid3());
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
  Watch(200, Always, 110, Rigid3());
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

TEST_F(FindingsTest, WheelsInMillimetresAreNamed) {
  Watch(200, Always, 110, ForwardCamera(), 500.0);
  ExpectOne({"m/s", "millimetres"});
}

TEST_F(FindingsTest, SourcesOfScaleThatDisagreeAreNamedWithTheBelievedOne) {
  Watch(200, Always);
  report_.map_scale.wheels = ScaleMeasurement{-0.03, 0.005};
  report_.map_scale.laser = ScaleMeasurement{0.0, 0.001};
  ExpectOne({"the wheels", "3.0 % smaller", "the laser", "calibrate"});
  report_.map_scale.wheels.reset();
  report_.map_scale.floor = ScaleMeasurement{0.05, 0.005};
  ExpectOne({"height over the floor", "5.0 % larger", "the laser"});
}

TEST_F(FindingsTest, LostImagesHolesAndDarknessAreNamed) {
  std::mt19937 generator(3);
  Watch(400, [&generator](int) { return generator() % 2 == 0; });
  ExpectOne({"lost", "compressed"});
  watch_ = InputWatch();
  Watch(200, [](int i) { return i < 100 || i > 130; });
  ExpectOne({"images: 1 hole", "3.2 s"});
  watch_ = InputWatch();
  Watch(200, Always, 5);
  ExpectOne({"100 %", "black"});
  watch_ = InputWatch();
  Watch(200, Always, 250);
  ExpectOne({"white"});
}

TEST_F(FindingsTest, ASlowCameraLosesNothing) {
  Watch(400, [](int i) { return i % 5 == 0; });
  EXPECT_TRUE(Found().empty()) << Found().front();
  watch_ = InputWatch();
  Watch(400, [](int i) { return i % 15 == 0; });
  EXPECT_TRUE(Found().empty()) << Found().front();
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

TEST_F(FindingsTest, TwoSourcesOfOdometryOnOneTopicAreNamed) {
  Watch(200, Always);
  InputWatch both = watch_, noisy = watch_;
  std::mt19937 generator(3);
  std::normal_distribution<double> noise(0.0, 0.001);  // m
  for (int i = 0; i < 1000; ++i) {
    const double t = 20.0 + 0.02 * i, x = 0.5 * t;
    both.Add(OdometryReading{Timestamp::FromSeconds(t), Rigid2(x, 0.0, 0.0)});
    both.Add(OdometryReading{Timestamp::FromSeconds(t + 0.001), Rigid2(x - 0.03, 0.0, 0.0)});
    noisy.Add(OdometryReading{Timestamp::FromSeconds(t), Rigid2(x + noise(generator), noise(generator), 0.0)});
  }
  watch_ = noisy;
  EXPECT_TRUE(Found().empty()) << Found().front();
  watch_ = both;
  ExpectOne({"of odometry's steps", "two sources"});
}

TEST_F(FindingsTest, StreamsOfComputersWhoseClocksDifferAreNamed) {
  Watch(200, Always);
  LaserFrame frame;
  for (const double t : {1000.0, 1000.1}) {
    frame.scan.stamp = Timestamp::FromSeconds(t);
    watch_.Add(frame);
  }
  ExpectOne({"the laser", "980.1 s", "after", "clocks"});
  watch_ = InputWatch();
  for (int i = 0; i < 200; ++i) {
    watch_.Add(Image(4000.0 + kPeriod * i, 110, ForwardCamera()));
    watch_.Add(OdometryReading{Timestamp::FromSeconds(kPeriod * i), Rigid2(0.1 * i, 0.0, 0.0)});
  }
  with_map_ = false;
  ExpectOne({"odometry", "3980.1 s", "before", "clocks"});
}

TEST_F(FindingsTest, OdometryThatNeverMovesIsNamedWhereNoMapCame) {
  Watch(200, Always, 110, ForwardCamera(), 0.0);
  EXPECT_TRUE(Found().empty()) << Found().front();
  with_map_ = false;
  ExpectOne({"odometry never moved", "init=visual"});
}

// What a clock that is far off spoils is not blamed on mount and wheels.
TEST_F(FindingsTest, AClockThatIsFarOffIsTheOnlyFaultNamed) {
  Watch(200, Always);
  map_ =
      Drive([](const Rigid2& step) { return Rigid2(step.translation.x(), step.translation.y(), 1.06 * step.angle); });
  report_.odometry_rejected = 60;
  FindingsInput input{report_, watch_, &map_};
  EXPECT_EQ(Findings(input).size(), 2U);
  input.motion.time_offset = Deviation{-0.5, 0.005};
  const std::vector<Finding> found = FindAll(input);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].harm, Harm::kWorthless);
  for (const char* part : {"500 ms earlier", "chrony", "add -0.50 to calibration.time_offset"}) {
    EXPECT_NE(found[0].text.find(part), std::string::npos) << found[0].text;
  }
  input.motion.time_offset = Deviation{0.08, 0.005};
  EXPECT_EQ(Findings(input).size(), 3U) << "80 ms spoil no drive";
  input.motion.time_offset = Deviation{0.5, 0.2};
  EXPECT_EQ(Findings(input).size(), 2U) << "that is no certainty";
}

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

TEST_F(FindingsTest, UnusedInputCountsWhereItIsMuch) {
  Watch(200, Always);
  unused_["image not decodable"] = 100;
  ExpectOne({"100 x image not decodable"});
  unused_.clear();
  unused_["odometry covariance that is a placeholder"] = 900;
  ExpectOne({"placeholders", "odometry_noise"});
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

TEST_F(FindingsTest, NotesOfTheRecordingComeLastAndTenLinesAreEnough) {
  Watch(200, Always, 5);
  for (int i = 0; i < 20; ++i) notes_.push_back("note " + std::to_string(i));
  const std::vector<std::string> found = Found();
  ASSERT_EQ(found.size(), kMostFindings);
  EXPECT_NE(found[0].find("black"), std::string::npos);
  EXPECT_EQ(found[1], "note 0");
}

TEST(WheelCheckTest, SaysNothingOfAFewSteps) {
  const WheelCheck check = CheckWheels(Map());
  EXPECT_FALSE(check.turn.has_value() || check.direction.has_value());
}

}  // namespace
}  // namespace planar_vslam
