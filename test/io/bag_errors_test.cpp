#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "bag_testing.h"

namespace planar_vslam::test {
namespace {

namespace fs = std::filesystem;

using BagErrors = BagFixture;

TEST_P(BagErrors, BagsWithoutUsableImagesSaySo) {
  ExpectInError(OpenError(Bag([](BagWriter&) {})), {"drive.", "no images", "sensor_msgs/Image"});
  ExpectInError(OpenError(Bag([](BagWriter& w) { w.PutImage(0.1, RawImage(RampImage(), "32FC1")); })),
                {"/camera/image_raw", "32FC1"});
  ExpectInError(OpenError(Bag([](BagWriter& w) { w.PutImage(0.1, RawImage(RampImage(64, 48), "mono8")); })),
                {"/camera/image_raw", "64x48", "32x24", "/camera/camera_info"});
}

TEST_P(BagErrors, CameraInfoErrorsNameTheTopic) {
  const auto error = [&](const sensor_msgs::CameraInfo& info) {
    {
      BagWriter writer(Path());
      writer.PutInfo(info);
      writer.PutImage(0.1);
    }
    return OpenError(Path());
  };
  sensor_msgs::CameraInfo info = Info();
  info.K.fill(0.0);
  ExpectInError(error(info), {"/camera/camera_info", "zero"});
  info = Info();
  info.D.resize(3);
  ExpectInError(error(info), {"/camera/camera_info", "3 numbers in D"});
  info = Info();
  info.binning_x = 2;
  ExpectInError(error(info), {"/camera/camera_info", "32x24", "expected 16x24"});
  info = Info();
  info.D.clear();
  info.distortion_model = "";
  EXPECT_EQ(error(info), "");
  {
    BagWriter writer(Path());
    writer.PutImage(0.1);
  }
  ExpectInError(OpenError(Path()), {"sensor_msgs/CameraInfo", "/camera/camera_info"});
}

TEST_P(BagErrors, RectifiedImagesUseTheProjectionMatrix) {
  const Replay replay = Play(Bag([](BagWriter& writer) {
    sensor_msgs::Image image = RawImage(RampImage(), "mono8");
    image.header.stamp = At(0.1);
    writer.Put("/camera/image_rect", image, 0.1);
  }));
  EXPECT_EQ(replay.info.camera.fx, 28.0);
  EXPECT_EQ(replay.info.camera.cy, 11.0);
  EXPECT_FALSE(replay.info.camera.distorted());
}

TEST_P(BagErrors, AmbiguousAndWrongTopicsAreNamed) {
  const fs::path path = Bag([](BagWriter& writer) {
    writer.PutImage(0.1);
    writer.Put("/other/image_raw", RawImage(RampImage(), "mono8"), 0.2);
    writer.Put("/other/camera_info", Info(), 0.2);
  });
  ExpectInError(OpenError(path), {"several", "/camera/image_raw", "/other/image_raw", "--set topics.image=TOPIC"});
  RecordingOptions options;
  options.bag.image_topic = "/camera/image_raw";
  EXPECT_EQ(OpenError(path, options), "");
  options.bag.image_topic = "/camera/nothing";
  ExpectInError(OpenError(path, options), {"/camera/nothing", "topics.image", "/other/image_raw"});
  options.bag.image_topic = "/camera/image_raw";
  options.bag.odometry_topic = "/odom";
  ExpectInError(OpenError(path, options), {"/odom", "topics.odometry", "nav_msgs/Odometry"});
}

TEST_P(BagErrors, MissingFramesAreNamedWithTheKnownOnes) {
  RecordingOptions options;
  options.bag.base_frame = "base";
  ExpectInError(OpenError(RobotBag(), options), {"'base'", "camera_optical_frame", "base_footprint"});
  ExpectInError(OpenError(Bag([](BagWriter& writer) {
                  writer.PutStatic("base_footprint", "head", Shift(0, 0, 1));
                  writer.PutImage(0.1);
                })),
                {"'camera_optical_frame'", "base_footprint, head"});
  ExpectInError(OpenError(Bag([](BagWriter& writer) {
                  writer.PutStatic("base_footprint", "camera_optical_frame", Shift(0, 0, 1));
                  writer.PutImage(0.1);
                  writer.PutScan(0.1);
                })),
                {"'laser_frame'"});
  ExpectInError(OpenError(Bag([](BagWriter& writer) {
                  writer.PutStatic("base_footprint", "camera_optical_frame", Shift(0, 0, 1));
                  writer.PutImage(0.1);
                  writer.PutOdometry(0.1, 0.0, "wheels");
                })),
                {"'wheels'", "child_frame_id"});
  ExpectInError(OpenError(Bag([](BagWriter& writer) {
                  writer.PutImage(0.1);
                  writer.PutOdometry(0.1, 0.0);
                })),
                {"no tf", "base_footprint", "camera_optical_frame"});
  ExpectInError(OpenError(Bag([](BagWriter& writer) {
                  writer.PutStatic("base_footprint", "torso", Shift(0, 0, 1));
                  writer.PutStatic("head", "camera_optical_frame", Shift(0, 0, 1));
                  writer.PutImage(0.1);
                })),
                {"connect", "base_footprint", "camera_optical_frame"});
  ExpectInError(OpenError(Bag([](BagWriter& writer) {
                  writer.PutStatic("torso", "camera_optical_frame", Shift(0, 0, 1));
                  writer.PutStatic("base_footprint", "camera_optical_frame", Shift(0, 0, 1));
                  writer.PutStatic("base_footprint", "laser_frame", Shift(0, 0, 1));
                  writer.PutImage(0.1);
                })),
                {"connect", "'camera_optical_frame' has a second parent", "'base_footprint'"});
}

TEST_P(BagErrors, ABaseWithoutAFrameOnTheFloorSaysHowToNameIt) {
  ExpectInError(OpenError(Bag([](BagWriter& writer) {
                  writer.PutStatic("base_link", "camera_optical_frame", Shift(0, 0, 1));
                  writer.PutImage(0.1);
                })),
                {"'base_footprint'", "--set topics.base_frame=base_link"});
}

TEST_P(BagErrors, FilesThatAreNoBagsAreErrors) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "x.bag";
  for (const char* text : {"", "#ROSBAG V1.2\n", "hello world, this is no bag"}) {
    WriteText(path, text);
    ExpectInError(OpenError(path), {"x.bag", "#ROSBAG V2.0"});
  }
  RecordingOptions options;
  options.odometry_file = "odometry.csv";
  ExpectInError(OpenError(RobotBag(), options), {"drive.", "dataset folder"});
}

TEST_P(BagErrors, WhatMayNotBeReadIsSaid) {
  const fs::path path = RobotBag();
  {
    const AsReader reader(path);
    if (!reader.works()) GTEST_SKIP() << "root that cannot be anybody else, or a folder of root's";
    EXPECT_EQ(OpenError(path), "");
  }
  const AsReader reader(path, fs::perms::none);
  ExpectInError(OpenError(path), {"drive.", "cannot be read: Permission denied"});
}

std::string Contents(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

// Over lengths, offsets, field names, payload: whatever it hits, the answer is an error or skipped messages.
TEST_P(BagErrors, DamagedBagsAreErrorsNotCrashes) {
  const std::string whole = Contents(RobotBag());
  const TemporaryFolder folder;
  const fs::path path = folder.path() / (std::string("damaged") + GetParam());
  for (const char byte : {'\0', '\x7f', '\xff'}) {
    for (std::size_t at = 13; at + 16 < whole.size(); at += whole.size() / 97) {
      std::string damaged = whole;
      std::fill_n(damaged.begin() + static_cast<std::ptrdiff_t>(at), 16, byte);
      WriteText(path, damaged);
      const Replay replay = Play(path);
      EXPECT_EQ(replay.error.find('\n'), std::string::npos);
    }
  }
}

using Rosbags = BagFixture;

TEST_P(Rosbags, WhatIsNoOdometryIsNamedWhereThereIsNone) {
  fs::path bag_without_odometry;
  const auto notes = [&](bool with_odometry) {
    const fs::path path = Bag([with_odometry](BagWriter& writer) {
      writer.PutStatic("base_footprint", "camera_optical_frame", Shift(0.1, 0, 1.1));
      writer.PutImage(0.1);
      if (with_odometry) writer.PutOdometry(0.1, 0.0);
    });
    rosbag::Bag bag(path.string(), rosbag::bagmode::Append);
    bag.write("/commands", At(0.1), geometry_msgs::Twist());
    bag.close();
    if (!with_odometry) bag_without_odometry = path;
    return Play(path).info.notes;
  };
  EXPECT_TRUE(notes(true).empty());
  ASSERT_EQ(notes(false).size(), 1U);
  ExpectInError(notes(false)[0], {"no odometry", "/commands (geometry_msgs/Twist)", "nav_msgs/Odometry"});
  RecordingOptions options;
  options.require_odometry = true;
  ExpectInError(OpenError(bag_without_odometry, options), {"no odometry", "/commands (geometry_msgs/Twist)"});
}

TEST_P(Rosbags, CutOnesAndThoseNeverClosedAreErrors) {
  const std::string whole = Contents(RobotBag());
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "cut.bag";
  for (const double share : {0.001, 0.3, 0.7, 0.95, 0.999}) {
    WriteText(path, whole.substr(0, static_cast<std::size_t>(share * static_cast<double>(whole.size()))));
    ExpectInError(OpenError(path), {"cut.bag"});
    if (share > 0.1) ExpectInError(OpenError(path), {"rosbag reindex"});
  }
  // A bag that was never closed: no index position in its header.
  std::string unindexed = whole;
  const std::size_t position = unindexed.find("index_pos=");
  std::fill_n(unindexed.begin() + static_cast<std::ptrdiff_t>(position) + 10, 8, '\0');
  WriteText(path, unindexed);
  ExpectInError(OpenError(path), {"cut.bag", "no index", "reindex"});
}

INSTANTIATE_TEST_SUITE_P(Bags, Rosbags, ::testing::Values(".bag"));
PV_WITH_EVERY_KIND_OF_BAG(BagErrors);

}  // namespace
}  // namespace planar_vslam::test
