// A robot that turns now and then, with wheels that turn a bit too far and a camera whose images come late.
#include "planar_vslam/pipeline/image_clock.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace planar_vslam {
namespace {

constexpr double kInterval = 0.1;  // s between images

class Drive {
 public:
  // `offset`: when images are taken, later than their stamps.
  Drive(double offset, unsigned seed) : offset_(offset), generator_(seed) {}

  // Swings for 2 s, drives straight for 2 s.
  static double HeadingAt(double t) {
    const double cycle = std::floor(t / 4.0), in = std::min(2.0, t - 4.0 * cycle);
    const double turned = 0.6 * (1.0 - std::cos(M_PI * in / 2.0)), way = std::fmod(cycle, 2.0) == 0.0 ? 1.0 : -1.0;
    return (way > 0.0 ? 0.0 : 1.2) + way * turned;
  }

  FramePacket PacketAt(double t, const ImageOffset& applied) const {
    FramePacket packet;
    packet.image.stamp = Timestamp::FromSeconds(t);
    packet.image_offset = applied;
    packet.T_base_exposed = Rigid2(0.0, 0.0, WheelsAt(t + applied.value) - WheelsAt(t));
    packet.T_odom_base = Rigid2(0.0, 0.0, WheelsAt(t));
    for (double s = t - kInterval; s < t + 0.001; s += 0.02) {
      packet.odometry.push_back({Timestamp::FromSeconds(s), Rigid2(0.0, 0.0, WheelsAt(s))});
    }
    return packet;
  }
  // By its view, which shows the base when the image was taken.
  Rigid2 SeenAt(double t, const FramePacket& packet) {
    std::normal_distribution<double> sway(0.0, 2e-3);
    return Rigid2(0.0, 0.0, 0.7 + HeadingAt(t + offset_) + sway(generator_)) * packet.T_base_exposed.Inverse();
  }
  ImageOffset Learn(ImageClock* clock, double from, double to) {
    for (double t = from; t < to; t += kInterval) {
      const FramePacket packet = PacketAt(t, clock->offset());
      clock->Watch(packet, SeenAt(t, packet));
    }
    return clock->offset();
  }

 private:
  static double WheelsAt(double t) { return 1.02 * HeadingAt(t); }

  double offset_;
  std::mt19937 generator_;
};

TEST(ImageClock, LearnsThatImagesComeLate) {
  for (const double offset : {-0.08, -0.02, 0.02}) {
    ImageClock clock({});
    const ImageOffset learned = Drive(offset, 1).Learn(&clock, 0.0, 40.0);
    EXPECT_NEAR(learned.value, offset, 0.003) << offset;
    EXPECT_LT(learned.sigma, 0.003) << offset;
  }
}

TEST(ImageClock, SaysHowWellItKnows) {
  for (const double offset : {-0.02, -0.05}) {
    double squares = 0.0;
    constexpr unsigned kDrives = 100;
    for (unsigned seed = 0; seed < kDrives; ++seed) {
      ImageClock clock({});
      const ImageOffset learned = Drive(offset, seed).Learn(&clock, 0.0, 30.0);
      squares += std::pow((learned.value - offset) / learned.sigma, 2);
    }
    const double rms = std::sqrt(squares / kDrives);
    EXPECT_LT(rms, 1.5) << offset;
    EXPECT_GT(rms, 0.3) << offset;
  }
}

TEST(ImageClock, TakesMostRobotsForPunctual) {
  ImageClock clock({});
  const ImageOffset learned = Drive(0.0, 2).Learn(&clock, 0.0, 20.0);
  EXPECT_NEAR(learned.value, 0.0, 0.001);
}

TEST(ImageClock, KnowsNothingBeforeItTurns) {
  ImageTimingOptions options;
  ImageClock clock(options);
  Drive drive(-0.02, 1);
  for (double t = 0.0; t < 20.0; t += kInterval) {
    FramePacket packet = drive.PacketAt(2.0 + 0.05 * t, clock.offset());  // stands still
    packet.image.stamp = Timestamp::FromSeconds(t);
    for (OdometryReading& reading : packet.odometry) reading.T_odom_base = *packet.T_odom_base;
    clock.Watch(packet, Rigid2(0.0, 0.0, 0.3));
  }
  EXPECT_EQ(clock.offset().value, 0.0);
  EXPECT_EQ(clock.offset().sigma, options.sigma_clock);
}

TEST(ImageClock, SlipsCountLittle) {
  ImageClock clock({});
  Drive drive(-0.02, 3);
  double slipped = 0.0;
  for (int k = 0; k < 400; ++k) {
    const double t = kInterval * k;
    if (k % 97 == 50) slipped += 0.1;  // while it turns or not
    const FramePacket packet = drive.PacketAt(t, clock.offset());
    clock.Watch(packet, Rigid2(0.0, 0.0, slipped) * drive.SeenAt(t, packet));
  }
  EXPECT_NEAR(clock.offset().value, -0.02, 0.005);
}

TEST(ImageClock, MapThatIsBentTellsNothing) {
  ImageClock clock({});
  Drive drive(0.0, 4);
  double bent = 0.0;
  for (int k = 0; k < 400; ++k) {
    const double t = kInterval * k;
    if (k % 40 == 2) {  // always when a turn begins
      bent += 0.05;
      clock.Forget();
    }
    const FramePacket packet = drive.PacketAt(t, clock.offset());
    clock.Watch(packet, Rigid2(0.0, 0.0, bent) * drive.SeenAt(t, packet));
  }
  EXPECT_NEAR(clock.offset().value, 0.0, 0.002);
}

TEST(ImageClock, LearnsNothingWhereItMustNot) {
  ImageTimingOptions options;
  options.learn_clock = false;
  ImageClock clock(options);
  EXPECT_EQ(Drive(-0.08, 1).Learn(&clock, 0.0, 40.0).value, 0.0);
}

TEST(ImageClock, FramesWithoutOdometryOrViewAreLeftOut) {
  ImageClock clock({});
  Drive drive(-0.02, 1);
  for (double t = 0.0; t < 10.0; t += kInterval) clock.Watch(drive.PacketAt(t, clock.offset()), std::nullopt);
  FramePacket alone;
  alone.image.stamp = Timestamp::FromSeconds(10.0);
  clock.Watch(alone, Rigid2());
  EXPECT_EQ(clock.offset().value, 0.0);
  EXPECT_NEAR(drive.Learn(&clock, 12.0, 52.0).value, -0.02, 0.003);
}

}  // namespace
}  // namespace planar_vslam
