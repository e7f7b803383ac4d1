// What single drivers and recorders do that is legitimate, and what is not but can be told.
#include <gtest/gtest.h>

#include "bag_testing.h"

namespace planar_vslam::test {
namespace {

class DriverHabits : public BagFixture {};

// image_transport packs a Bayer mosaic as it is.
TEST_P(DriverHabits, AMosaicInAJpegIsTakenForGrey) {
  const Replay replay = Play(Bag([](BagWriter& writer) {
    sensor_msgs::CompressedImage image;
    image.header.frame_id = "camera_optical_frame";
    image.header.stamp = At(0.1);
    image.format = "bayer_rggb8; jpeg compressed ";
    cv::imencode(".jpg", RampImage(), image.data, {cv::IMWRITE_JPEG_QUALITY, 100});
    writer.Put("/camera/image_raw/compressed", image, 0.1);
  }));
  ASSERT_EQ(replay.images.size(), 1U) << replay.error;
  EXPECT_NEAR((*replay.images[0].image.image.pixels)[7], 28, 2);
}

TEST_P(DriverHabits, RowsWithoutALengthAreTooShort) {
  const std::string error = OpenError(Bag([](BagWriter& writer) {
    sensor_msgs::Image image = RawImage(RampImage(), "mono8");
    image.step = 0;
    writer.PutImage(0.1, image);
  }));
  ExpectInError(error, {"/camera/image_raw", "step 0", "too short"});
}

// UTM coordinates, as a filter with GPS gives them.
TEST_P(DriverHabits, OdometryMayBeFarFromItsOrigin) {
  const Replay replay = Play(Bag([](BagWriter& writer) {
    writer.PutStatic("base_footprint", "camera_optical_frame", Shift(0, 0, 1));
    for (int i = 0; i < 10; ++i) {
      nav_msgs::Odometry odometry;
      odometry.pose.pose.position.y = 9.99e6;
      writer.PutOdometry(0.1 * i, 4.5e5 + 0.01 * i, "base_footprint", 0.004, odometry);
    }
    writer.PutImage(0.5);
  }));
  ASSERT_EQ(replay.odometry.size(), 10U) << replay.error;
  for (std::size_t i = 1; i < replay.odometry.size(); ++i) {
    const Rigid2 step = replay.odometry[i - 1].T_odom_base.Inverse() * replay.odometry[i].T_odom_base;
    EXPECT_NEAR(step.translation.x(), 0.01, 1e-8);
    EXPECT_NEAR(step.translation.y(), 0.0, 1e-8);
  }
}

TEST_P(DriverHabits, OdometryThatNamesNoChildIsOfTheBase) {
  const Replay replay = Play(Bag([](BagWriter& writer) {
    writer.PutStatic("base_footprint", "camera_optical_frame", Shift(0, 0, 1));
    writer.PutStatic("base_footprint", "base_link", Shift(0.2, 0, 0.12));
    for (int i = 0; i < 5; ++i) writer.PutOdometry(0.1 * i, 0.1 * i, "");
    writer.PutImage(0.2);
  }));
  ASSERT_EQ(replay.odometry.size(), 5U) << replay.error;
  EXPECT_NEAR(replay.odometry[3].T_odom_base.translation.x(), 0.3, 1e-12);
}

// Two drivers on one topic, each with its own mount: the first one counts, the other is told.
TEST_P(DriverHabits, WhatIsOfAnotherFrameIsLeftOutAndCounted) {
  const Replay replay = Play(Bag([](BagWriter& writer) {
    for (const char* frame : {"camera_optical_frame", "rear_optical_frame", "laser_frame", "rear_laser_frame"}) {
      writer.PutStatic("base_footprint", frame, Shift(0, 0, 1));
    }
    writer.PutStatic("base_footprint", "wheels", Shift(0, 0, 0.1));
    for (int i = 0; i < 10; ++i) {
      sensor_msgs::Image image = RawImage(RampImage(), "mono8");
      if (i % 2 == 1) image.header.frame_id = "rear_optical_frame";
      writer.PutImage(0.1 * i, image);
      writer.PutOdometry(0.1 * i, 0.01 * i, i % 2 == 1 ? "wheels" : "base_footprint");
      writer.PutScan(0.1 * i, 0.01, i % 2 == 1 ? "rear_laser_frame" : "laser_frame");
    }
  }));
  EXPECT_EQ(replay.error, "");
  EXPECT_EQ(replay.images.size(), 5U);
  EXPECT_EQ(replay.odometry.size(), 5U);
  EXPECT_EQ(replay.scans.size(), 5U);
  for (const char* reason : {"image of another frame", "scan of another frame", "odometry of another child frame"}) {
    EXPECT_EQ(replay.skipped.count(reason), 1U) << reason;
  }
}

INSTANTIATE_TEST_SUITE_P(Bags, DriverHabits, ::testing::Values(".bag", ".mcap", ".db3"));

TEST(PackedRosbags, AreReadWhateverPacksThem) {
  const TemporaryFolder folder;
  for (const auto compression :
       {rosbag::compression::Uncompressed, rosbag::compression::BZ2, rosbag::compression::LZ4}) {
    const std::filesystem::path path = folder.path() / ("packed" + std::to_string(compression) + ".bag");
    rosbag::Bag bag;
    bag.setCompression(compression);
    bag.open(path.string(), rosbag::bagmode::Write);
    bag.write("/camera/camera_info", At(0.0), Info());
    for (int i = 1; i < 5; ++i) {
      sensor_msgs::Image image = RawImage(RampImage(), "mono8");
      image.header.stamp = At(0.1 * i);
      bag.write("/camera/image_raw", At(0.1 * i), image);
    }
    bag.close();
    const Replay replay = Play(path);
    ASSERT_EQ(replay.images.size(), 4U) << compression << replay.error;
    EXPECT_EQ((*replay.images[3].image.image.pixels)[7], 28);
  }
}

}  // namespace
}  // namespace planar_vslam::test
