#include <gtest/gtest.h>

#include <limits>
#include <opencv2/imgproc.hpp>

#include "bag_testing.h"

namespace planar_vslam::test {
namespace {

namespace fs = std::filesystem;

using BagRecording = BagFixture;

TEST_P(BagRecording, ARobotsTopicsComeInStampOrder) {
  const Replay replay = Play(RobotBag());
  EXPECT_EQ(replay.error, "");
  EXPECT_TRUE(replay.skipped.empty());
  EXPECT_EQ(replay.images.size(), 10U);
  EXPECT_EQ(replay.odometry.size(), 50U);
  EXPECT_EQ(replay.scans.size(), 5U);
  EXPECT_EQ(replay.order.substr(0, 13), "oooooioooooli");  // the image's own odometry and sweep come before it
  EXPECT_TRUE(replay.info.has_odometry && replay.info.has_laser && replay.info.has_base_transform);
  EXPECT_EQ(replay.info.image_count, 10);
  EXPECT_EQ(replay.info.first_image, StampAt(0.1));
  EXPECT_EQ(replay.info.last_image, StampAt(1.0));
  EXPECT_EQ(replay.info.camera.fy, 31.0);
  EXPECT_EQ(replay.info.camera.k3, 0.03);
  EXPECT_EQ(replay.images[0].image.stamp, StampAt(0.1));
  EXPECT_EQ((*replay.images[0].image.image.pixels)[32 * 5 + 7], 28);
  EXPECT_NEAR(replay.images[9].T_base_camera.translation.z(), 1.1, 1e-12);
  EXPECT_NEAR(replay.scans[4].T_base_laser.translation.z(), 0.25, 1e-12);
  EXPECT_EQ(replay.scans[0].scan.ranges.size(), 3U);
  EXPECT_NEAR(replay.odometry[49].T_odom_base.translation.x(), 0.5, 1e-12);
}

TEST_P(BagRecording, SaysWhichTopicsAndFramesItReads) {
  const RecordingInfo info = Play(RobotBag()).info;
  EXPECT_EQ(info.topics, "images /camera/image_raw, camera_info /camera/camera_info, odometry /odom, scans /scan");
  EXPECT_EQ(info.frames, "base_footprint > camera_optical_frame, base_footprint > laser_frame");
  const RecordingInfo moving = Play(Bag([](BagWriter& writer) {
                                 writer.PutStatic("base_footprint", "torso", Shift(0, 0, 1));
                                 writer.PutStatic("head", "camera_optical_frame", Shift(0.1, 0, 0));
                                 for (int i = 0; i <= 4; ++i) {
                                   writer.PutTf("torso", "head", 0.1 * i, Shift(0, 0.01 * i, 0));
                                   writer.PutTf("odom", "base_footprint", 0.1 * i, Shift(0.1 * i, 0, 0));
                                 }
                                 writer.PutImage(0.2);
                               })).info;
  EXPECT_EQ(moving.topics, "images /camera/image_raw, camera_info /camera/camera_info, odometry by tf");
  EXPECT_EQ(moving.frames,
            "base_footprint > torso > head > camera_optical_frame (moves), odom > base_footprint (moves)");
}

// A recorder that took all topics.
TEST_P(BagRecording, TheOtherFormsOfAnImageAreNoOtherImages) {
  const Replay replay = Play(Bag([](BagWriter& writer) {
    writer.PutImage(0.1);
    writer.Put("/camera/image_raw/compressed", sensor_msgs::CompressedImage(), 0.1);
    writer.Put("/camera/image_raw/compressedDepth", sensor_msgs::CompressedImage(), 0.1);
  }));
  EXPECT_EQ(replay.error, "");
  EXPECT_EQ(replay.images.size(), 1U);
}

TEST_P(BagRecording, ADepthCameraBesideTheImagesIsNone) {
  const Replay replay = Play(Bag([](BagWriter& writer) {
    writer.PutImage(0.1);
    writer.Put("/camera/aligned_depth_to_color/image_raw", RawImage(RampImage(), "16UC1"), 0.1);
    writer.Put("/camera/depth/image_raw", RawImage(RampImage(), "16UC1"), 0.1);
  }));
  EXPECT_EQ(replay.images.size(), 1U) << replay.error;
}

// A recorder that splits its files writes tf_static and camera_info into the first.
TEST_P(BagRecording, SeveralBagsAreOneDrive) {
  const Replay whole = Play(RobotBag());
  const fs::path first = Path().replace_filename(std::string("drive_0") + GetParam());
  const fs::path second = Path().replace_filename(std::string("drive_1") + GetParam());
  {
    BagWriter writers[] = {BagWriter(first), BagWriter(second)};
    const auto part = [&writers](double t) -> BagWriter& { return writers[t > 0.5 ? 1 : 0]; };
    writers[0].PutInfo();
    writers[0].PutStatic("base_footprint", "camera_optical_frame", Shift(0.1, 0, 1.1));
    writers[0].PutStatic("base_footprint", "laser_frame", Shift(0, 0, 0.25));
    for (int i = 1; i <= 50; ++i) part(0.02 * i).PutOdometry(0.02 * i, 0.01 * i);
    for (int i = 1; i <= 10; ++i) part(0.1 * i).PutImage(0.1 * i);
    for (int i = 1; i <= 5; ++i) part(0.2 * i).PutScan(0.2 * i);
  }
  for (const auto& paths : {std::vector<fs::path>{first, second}, std::vector<fs::path>{second, first}}) {
    Expected<std::unique_ptr<Recording>> recording = OpenRecording(paths, RecordingOptions{});
    ASSERT_TRUE(recording.ok()) << recording.error().message;
    EXPECT_EQ((*recording)->info().image_count, 10);
    std::string order;
    while (true) {
      const Expected<std::optional<RecordedEvent>> event = (*recording)->Next();
      ASSERT_TRUE(event.ok());
      if (!event->has_value()) break;
      order += std::holds_alternative<CameraFrame>(**event)  ? 'i'
               : std::holds_alternative<LaserFrame>(**event) ? 'l'
                                                             : 'o';
    }
    EXPECT_EQ(order, whole.order);
  }
}

TEST_P(BagRecording, AFolderAmongSeveralBagsIsNamed) {
  const TemporaryFolder folder;
  const auto recording = OpenRecording(std::vector<fs::path>{RobotBag(), folder.path()}, RecordingOptions{});
  ASSERT_FALSE(recording.ok());
  EXPECT_NE(recording.error().message.find("expected only bags"), std::string::npos) << recording.error().message;
}

TEST_P(BagRecording, OdometryCarriesWhatItsMessagesSayOfTheirError) {
  const auto drive = [this](double variance, double growth, double twist_growth, const Rigid3& T_child_base) {
    return Play(Bag([&](BagWriter& writer) {
      writer.PutStatic("base_footprint", "camera_optical_frame", Shift(0.1, 0, 1.1));
      writer.PutStatic("wheels", "base_footprint", T_child_base);
      for (int i = 0; i < 20; ++i) {
        nav_msgs::Odometry odometry;
        for (const std::size_t k : {0U, 7U, 35U}) {  // x, y, yaw
          odometry.pose.covariance[k] = variance + growth * i;
          odometry.twist.covariance[k] = variance + twist_growth * i;
        }
        writer.PutOdometry(0.02 * i, 0.01 * i, "wheels", 0.004, odometry);
      }
      writer.PutImage(0.1);
    }));
  };
  const Replay added = drive(1.0, 1e-6, 0.0, Shift(0, 0, 0.3));
  ASSERT_EQ(added.odometry.size(), 20U) << added.error;
  EXPECT_FALSE(added.odometry[0].covariance_rate.has_value());
  for (std::size_t k = 10; k < 20; ++k) {
    ASSERT_TRUE(added.odometry[k].covariance_rate.has_value()) << k;
    EXPECT_NEAR((*added.odometry[k].covariance_rate)(0, 0), 1e-6 / 0.02, 1e-8);
  }
  const Replay of_twist = drive(0.01, 0.0, 1e-4, Shift(0, 0, 0));
  ASSERT_TRUE(of_twist.odometry[15].covariance_rate.has_value());
  EXPECT_NEAR((*of_twist.odometry[15].covariance_rate)(2, 2), 0.0115, 1e-12);
  // What is about another point than the base.
  for (const OdometryReading& reading : drive(1.0, 1e-6, 1e-4, Shift(0.2, 0, 0)).odometry) {
    EXPECT_FALSE(reading.covariance_rate.has_value());
  }
}

TEST_P(BagRecording, AHandheldBagHasNoBase) {
  const Replay replay = Play(Bag([](BagWriter& writer) { writer.PutImage(0.1); }));
  EXPECT_EQ(replay.order, "i");
  EXPECT_FALSE(replay.info.has_odometry || replay.info.has_laser || replay.info.has_base_transform);
  RecordingOptions options;
  options.require_odometry = true;
  ExpectInError(OpenError(Path(), options), {"drive.", "nav_msgs/Odometry", "odom", "base_footprint"});
}

TEST_P(BagRecording, AnEmptyBaseFrameIgnoresWheelsAndLaser) {
  RecordingOptions options;
  options.bag.base_frame = "";
  const Replay replay = Play(RobotBag(), options);
  EXPECT_EQ(replay.order, "iiiiiiiiii");
  EXPECT_FALSE(replay.info.has_odometry || replay.info.has_laser || replay.info.has_base_transform);
}

TEST_P(BagRecording, EveryEncodingBecomesTheSameGrey) {
  const cv::Mat gray = RampImage();
  cv::Mat bgr, bgra, wide;
  cv::cvtColor(gray, bgr, cv::COLOR_GRAY2BGR);
  cv::cvtColor(gray, bgra, cv::COLOR_GRAY2BGRA);
  gray.convertTo(wide, CV_16UC1, 256.0);
  cv::Mat padded(gray.rows, gray.cols + 5, CV_8UC1, cv::Scalar(255));
  gray.copyTo(padded.colRange(0, gray.cols));
  sensor_msgs::Image padded_message = RawImage(padded, "mono8");
  padded_message.width = kTestWidth;
  cv::Mat swapped = wide.clone();
  for (auto value = swapped.begin<std::uint16_t>(); value != swapped.end<std::uint16_t>(); ++value)
    *value = *value >> 8;
  sensor_msgs::Image big_endian = RawImage(swapped, "mono16");
  big_endian.is_bigendian = 1;
  cv::Mat uyvy(gray.rows, gray.cols, CV_8UC2), yuyv(gray.rows, gray.cols, CV_8UC2), wide_bgra;
  const cv::Mat no_color(gray.rows, gray.cols, CV_8UC1, cv::Scalar(128));
  cv::merge(std::vector<cv::Mat>{no_color, gray}, uyvy);
  cv::merge(std::vector<cv::Mat>{gray, no_color}, yuyv);
  cv::merge(std::vector<cv::Mat>{wide, wide, wide, wide}, wide_bgra);
  sensor_msgs::Image planes = RawImage(gray, "nv21");  // colour at half the size follows
  planes.data.resize(planes.data.size() * 3 / 2, 128);
  const std::vector<sensor_msgs::Image> messages{RawImage(gray, "mono8"),
                                                 RawImage(uyvy, "yuv422"),
                                                 RawImage(uyvy, "uyvy"),
                                                 RawImage(yuyv, "yuv422_yuy2"),
                                                 RawImage(yuyv, "yuyv"),
                                                 RawImage(wide_bgra, "bgra16"),
                                                 RawImage(wide_bgra, "rgba16"),
                                                 planes,
                                                 RawImage(bgr, "bgr8"),
                                                 RawImage(bgr, "rgb8"),
                                                 RawImage(bgra, "bgra8"),
                                                 RawImage(wide, "mono16"),
                                                 padded_message,
                                                 big_endian,
                                                 RawImage(gray, "8UC1")};
  const Replay replay = Play(Bag([&](BagWriter& writer) {
    for (std::size_t i = 0; i < messages.size(); ++i) writer.PutImage(0.1 * static_cast<double>(i), messages[i]);
  }));
  ASSERT_EQ(replay.images.size(), messages.size()) << replay.error;
  for (const CameraFrame& frame : replay.images) {
    EXPECT_EQ(*frame.image.image.pixels, *replay.images[0].image.image.pixels);
  }
}

TEST_P(BagRecording, BayerPatternsAreNotMixedUp) {
  for (const auto& [encoding, red_x, red_y] : {std::tuple("bayer_rggb8", 0, 0), std::tuple("bayer_bggr8", 1, 1),
                                               std::tuple("bayer_gbrg8", 0, 1), std::tuple("bayer_grbg8", 1, 0)}) {
    cv::Mat red_only(kTestHeight, kTestWidth, CV_8UC1, cv::Scalar(0));
    for (int y = red_y; y < red_only.rows; y += 2) {
      for (int x = red_x; x < red_only.cols; x += 2) red_only.at<std::uint8_t>(y, x) = 200;
    }
    const Replay replay = Play(Bag([&](BagWriter& writer) { writer.PutImage(0.1, RawImage(red_only, encoding)); }));
    ASSERT_EQ(replay.images.size(), 1U) << replay.error;
    // Pure red is 0.299 of its value in grey.
    EXPECT_NEAR((*replay.images[0].image.image.pixels)[32 * 10 + 10], 60, 1) << encoding;
  }
}

TEST_P(BagRecording, CompressedImagesAreDecodedAndBrokenOnesSkipped) {
  const fs::path path = Bag([](BagWriter& writer) {
    sensor_msgs::CompressedImage image;
    image.format = "png";
    cv::imencode(".png", RampImage(), image.data);
    for (int i = 1; i <= 3; ++i) {
      image.header.stamp = At(0.1 * i);
      if (i == 2) image.data.resize(10);
      if (i == 3) cv::imencode(".png", RampImage(), image.data);
      writer.Put("/camera/image_raw/compressed", image, 0.1 * i);
    }
  });
  RecordingOptions options;
  for (const char* topic : {"", "/camera/image_raw/compressed", "/camera/image_raw", "camera/image_raw"}) {
    options.bag.image_topic = topic;
    const Replay replay = Play(path, options);
    ASSERT_EQ(replay.images.size(), 2U) << topic << replay.error;
    EXPECT_EQ((*replay.images[0].image.image.pixels)[7], 28);
    EXPECT_EQ(replay.skipped.at("image not decodable"), 1);
  }
}

TEST_P(BagRecording, AMovingNeckIsInterpolatedAtTheImagesStamp) {
  // base_link -> base_footprint points up the tree, base_link -> neck moves, neck -> camera is fixed.
  const Replay replay = Play(Bag([](BagWriter& writer) {
    writer.PutStatic("base_link", "base_footprint", Shift(0, 0, -0.3));
    writer.PutStatic("/neck", "/camera_optical_frame", Shift(0.1, 0, 0));
    writer.PutTf("base_link", "neck", 0.10, Shift(0, 0, 1.0));
    writer.PutTf("base_link", "neck", 0.30, Shift(0, 0, 1.2));
    writer.PutTf("neck", "ear", 0.30, Shift(0, 0, 1.2));
    for (int i = 0; i < 5; ++i) writer.PutImage(0.05 + 0.1 * i);
  }));
  ASSERT_EQ(replay.images.size(), 2U) << replay.error;
  EXPECT_EQ(replay.skipped.at("image whose stamp tf does not cover"), 3);
  EXPECT_NEAR((replay.images[0].T_base_camera.translation - Eigen::Vector3d(0.1, 0, 1.35)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((replay.images[1].T_base_camera.translation - Eigen::Vector3d(0.1, 0, 1.45)).norm(), 0.0, 1e-9);
}

TEST_P(BagRecording, OdometryIsTakenFromTfWhereThereIsNoTopic) {
  const auto add = [](BagWriter& writer) {
    writer.PutStatic("base_link", "base_footprint", Shift(0.5, 0, 0));
    writer.PutStatic("base_link", "camera_optical_frame", Shift(0.1, 0, 1));
    for (int i = 1; i <= 10; ++i) writer.PutTf("odom", "base_link", 0.1 * i, Shift(0.1 * i, 0, 0));
    writer.PutImage(0.5);
  };
  const Replay replay = Play(Bag(add));
  ASSERT_EQ(replay.odometry.size(), 10U) << replay.error;
  EXPECT_TRUE(replay.info.has_odometry);
  EXPECT_NEAR(replay.odometry[9].T_odom_base.translation.x(), 1.5, 1e-9);
  EXPECT_EQ(replay.order, "oooooiooooo");
  // The topic comes first where there are both; its pose of base_link is brought to the base.
  const Replay both = Play(Bag([&](BagWriter& writer) {
    add(writer);
    writer.PutOdometry(0.2, 7.0, "base_link");
  }));
  ASSERT_EQ(both.odometry.size(), 1U) << both.error;
  EXPECT_NEAR(both.odometry[0].T_odom_base.translation.x(), 7.5, 1e-9);
}

TEST_P(BagRecording, UnusableStampsAreSkippedAndCounted) {
  const Replay replay = Play(Bag([](BagWriter& writer) {
    writer.PutStatic("base_footprint", "camera_optical_frame", Shift(0, 0, 1));
    for (const double t : {0.1, 0.2, 0.2, 0.3}) writer.PutOdometry(t, 0.0);
    writer.PutOdometry(0.15, 0.0, "base_footprint", 0.1);
    writer.PutOdometry(0.4, std::numeric_limits<double>::quiet_NaN());
    writer.PutImage(0.1);
    writer.PutImage(0.1, RawImage(RampImage(), "mono8"), 0.2);
    sensor_msgs::Image unstamped = RawImage(RampImage(), "mono8");
    writer.Put("/camera/image_raw", unstamped, 0.5);
    writer.PutImage(0.6);
  }));
  EXPECT_EQ(replay.order, "oioooi");
  const std::map<std::string, long> expected{{"odometry with the stamp of another", 1},
                                             {"odometry pose not finite", 1},
                                             {"image with the stamp of another", 1},
                                             {"image stamp zero", 1}};
  EXPECT_EQ(replay.skipped, expected);
}

TEST_P(BagRecording, ImagesOfAnotherSizeOrEncodingAreSkipped) {
  const Replay replay = Play(Bag([](BagWriter& writer) {
    writer.PutImage(0.1);
    writer.PutImage(0.2, RawImage(RampImage(16, 12), "mono8"));
    writer.PutImage(0.3, RawImage(RampImage(), "32FC1"));
    sensor_msgs::Image cut = RawImage(RampImage(), "mono8");
    cut.data.resize(100);
    writer.PutImage(0.4, cut);
    writer.PutImage(0.5);
  }));
  EXPECT_EQ(replay.images.size(), 2U);
  EXPECT_EQ(replay.skipped.at("image of changed size"), 1);
  EXPECT_EQ(replay.skipped.at("image not decodable"), 2);
}

PV_WITH_EVERY_KIND_OF_BAG(BagRecording);

}  // namespace
}  // namespace planar_vslam::test
