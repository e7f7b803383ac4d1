// Findings about what came in: rates, ends, clocks, units.
#include <limits>

#include "findings_testing.h"

namespace planar_vslam {
namespace {

TEST_F(FindingsTest, WheelsInMillimetresAreNamed) {
  Watch(200, Always, 110, ForwardCamera(), 500.0);
  ExpectOne({"m/s", "millimetres"});
}

TEST_F(FindingsTest, WheelsInCentimetresAreNamedByTheirBends) {
  const auto drive = [this](double speed) {
    watch_ = InputWatch();
    for (int i = 0; i < 200; ++i) {
      const double t = kPeriod * i;
      const Eigen::Vector2d place = speed / 0.6 * Eigen::Vector2d(std::sin(0.6 * t), 1.0 - std::cos(0.6 * t));
      watch_.Add(OdometryReading{Timestamp::FromSeconds(t), Rigid2(place.x(), place.y(), WrapAngle(0.6 * t))});
      watch_.Add(Image(t, 110, ForwardCamera()));
    }
  };
  drive(10.0);
  EXPECT_TRUE(Found().empty()) << "a car: " << Found().front();
  drive(36.0);
  ExpectOne({"centimetres"});
}

TEST_F(FindingsTest, OdometryThatComesSeldomIsNotCalledAWrongMount) {
  for (int i = 0; i < 200; ++i) {
    if (i % 10 == 0) watch_.Add(OdometryReading{Timestamp::FromSeconds(kPeriod * i), Rigid2(0.05 * i, 0.0, 0.0)});
    watch_.Add(Image(kPeriod * i, 110, ForwardCamera()));
  }
  EXPECT_TRUE(Found().empty()) << Found().front();
  report_.odometry_rejected = 60;
  ExpectOne({"60 of 200 steps", "1.0 times a second", "10 Hz"});
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

TEST_F(FindingsTest, StreamsThatDoNotLastAsLongAsTheImagesAreNamed) {
  const auto watch = [this](double from, double till) {
    watch_ = InputWatch();
    for (int i = 0; i < 200; ++i) {
      const double t = kPeriod * i;
      if (t >= from && t <= till) watch_.Add(OdometryReading{Timestamp::FromSeconds(t), Rigid2(0.5 * t, 0.0, 0.0)});
      watch_.Add(Image(t, 110, ForwardCamera()));
    }
  };
  watch(1.0, 19.0);
  EXPECT_TRUE(Found().empty()) << Found().front();
  watch(5.0, 20.0);
  ExpectOne({"odometry starts 5.0 s after the images"});
  watch(0.0, 12.0);
  ExpectOne({"odometry ends 7.9 s before the images"});
}

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

// Half a sweep is no fault: a stamp may be that of its first or its last beam.
TEST_F(FindingsTest, ALasersClockIsNamedWhereItIsOffByMoreThanASweepExplains) {
  const auto found = [this](double period, double offset) {
    watch_ = InputWatch();
    Watch(200, Always);
    for (int i = 0; period * i < 20.0; ++i) {
      LaserFrame frame;
      frame.scan.stamp = Timestamp::FromSeconds(period * i);
      watch_.Add(frame);
    }
    FindingsInput input{report_, watch_, &map_};
    input.motion.laser_time_offset = Deviation{offset, 0.004};
    return FindAll(input);
  };
  for (const double offset : {0.1, -0.1}) {
    const std::vector<Finding> fast = found(0.1, offset);
    ASSERT_EQ(fast.size(), 1U);
    EXPECT_NE(fast[0].text.find(offset < 0.0 ? "100 ms later" : "100 ms earlier"), std::string::npos) << fast[0].text;
  }
  EXPECT_TRUE(found(0.1, 0.05).empty());
  EXPECT_TRUE(found(0.2, 0.1).empty());
  EXPECT_EQ(found(0.2, 0.2).size(), 1U);
}

TEST_F(FindingsTest, ALaserThatHangsIsNamedAndNotUsed) {
  const auto watch = [this](double speed, float range, bool hangs, std::size_t beams = 30) {
    watch_ = InputWatch();
    long used = 0;
    for (int i = 0; i < 200; ++i) {
      const double t = kPeriod * i;
      watch_.Add(OdometryReading{Timestamp::FromSeconds(t), Rigid2(speed * t, 0.0, 0.0)});
      watch_.Add(Image(t, 110, ForwardCamera()));
      LaserFrame frame;
      frame.scan.stamp = Timestamp::FromSeconds(t);
      frame.scan.range_max = 300.0;
      frame.scan.ranges.assign(beams, range);
      frame.scan.ranges.push_back(hangs ? 1.0F : static_cast<float>(i));
      frame.scan.ranges.push_back(std::numeric_limits<float>::quiet_NaN());
      used += watch_.Add(frame) ? 1 : 0;
    }
    return used;
  };
  has_laser_ = true;
  EXPECT_LT(watch(0.1, 2.0F, true), 12);
  ExpectOne({"of 200 sweeps are the same as before", "hangs"});
  EXPECT_EQ(watch(0.1, 2.0F, false), 200);
  EXPECT_EQ(watch(0.0, 2.0F, true), 200) << "a robot that stands";
  EXPECT_EQ(watch(0.1, 2.0F, true, 3), 200) << "three beams tell nothing";
  EXPECT_EQ(watch(0.1, 300.0F, true), 200) << "nothing within its range";
}

TEST_F(FindingsTest, ACameraThatHangsIsNamed) {
  const auto watch = [this](double speed, bool hangs, int images = 200, int last_good = 100) {
    watch_ = InputWatch();
    for (int i = 0; i < images; ++i) {
      const double t = kPeriod * i;
      watch_.Add(OdometryReading{Timestamp::FromSeconds(t), Rigid2(speed * t, 0.0, 0.0)});
      CameraFrame frame = Image(t, 110, ForwardCamera());
      std::vector<std::uint8_t> pixels = *frame.image.image.pixels;
      const int shown = hangs && i > last_good ? last_good : i;
      pixels[96] = static_cast<std::uint8_t>(shown % 256);
      pixels[128] = static_cast<std::uint8_t>(shown / 256);
      frame.image.image.pixels = std::make_shared<const std::vector<std::uint8_t>>(std::move(pixels));
      watch_.Add(frame);
    }
  };
  watch(0.1, true);
  ExpectOne({"of 200 images are the same as before", "hangs"});
  watch(0.1, false);
  EXPECT_TRUE(Found().empty()) << Found().front();
  watch(0.0, true);
  EXPECT_TRUE(Found().empty()) << "a robot that stands: " << Found().front();
  watch(0.1, true, 2000, 1955);  // of a robot that runs for long: within seconds
  ExpectOne({"of 2000 images are the same as before", "hangs"});
  watch(0.1, true, 2000, 1980);
  EXPECT_TRUE(Found().empty()) << "two seconds: " << Found().front();
}

TEST_F(FindingsTest, ACameraThatIsNowhereIsNamed) {
  Watch(200, Always, 110, Rigid3(ForwardCamera().rotation, Eigen::Vector3d(100.0, 0.0, 1118.0)));
  ExpectOne({"millimetres"});
  watch_ = InputWatch();
  Watch(200, Always, 110, Rigid3(ForwardCamera().rotation, Eigen::Vector3d(0.1, 0.0, 0.0)));
  ExpectOne({"0.00 m above the base frame", "height"});
}

TEST_F(FindingsTest, UnusedInputCountsWhereItIsMuch) {
  Watch(200, Always);
  unused_["image not decodable"] = 100;
  ExpectOne({"100 x image not decodable"});
  unused_.clear();
  unused_["odometry covariance that is a placeholder"] = 900;
  ExpectOne({"placeholders", "odometry_noise"});
}

TEST_F(FindingsTest, NotesOfTheRecordingComeLastAndTenLinesAreEnough) {
  Watch(200, Always, 5);
  for (int i = 0; i < 20; ++i) notes_.push_back("note " + std::to_string(i));
  const std::vector<std::string> found = Found();
  ASSERT_EQ(found.size(), kMostFindings);
  EXPECT_NE(found[0].find("black"), std::string::npos);
  EXPECT_EQ(found[1], "note 0");
}

}  // namespace
}  // namespace planar_vslam
