#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/LaserScan.h>
#include <tf2_msgs/TFMessage.h>

#include <cmath>
#include <iterator>
#include <opencv2/imgproc.hpp>

#include "recording_testing.h"
#include "support/support.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;
using test::ExpectInError;
using test::OpenError;
using test::Play;
using test::Replay;

constexpr double kEpoch = 1'700'000'000.0;  // s

ros::Time At(double seconds) {
  return ros::Time().fromNSec(static_cast<std::uint64_t>(std::llround((kEpoch + seconds) * 1e3)) * 1'000'000U);
}
Timestamp StampAt(double seconds) { return {static_cast<std::int64_t>(At(seconds).toNSec())}; }

sensor_msgs::CameraInfo Info() {
  sensor_msgs::CameraInfo info;
  info.width = test::kTestWidth;
  info.height = test::kTestHeight;
  info.distortion_model = "plumb_bob";
  info.D = {0.1, -0.2, 0.001, 0.002, 0.03};
  info.K = {30, 0, 16, 0, 31, 12, 0, 0, 1};
  info.P = {28, 0, 15, 0, 0, 29, 11, 0, 0, 0, 1, 0};
  return info;
}

sensor_msgs::Image RawImage(const cv::Mat& pixels, const std::string& encoding) {
  sensor_msgs::Image image;
  image.header.frame_id = "camera_optical_frame";
  image.width = static_cast<std::uint32_t>(pixels.cols);
  image.height = static_cast<std::uint32_t>(pixels.rows);
  image.encoding = encoding;
  image.step = static_cast<std::uint32_t>(pixels.step[0]);
  image.data.assign(pixels.datastart, pixels.dataend);
  return image;
}

tf2_msgs::TFMessage Tf(const std::string& parent, const std::string& child, double t, const Rigid3& T) {
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = parent;
  transform.header.stamp = At(t);
  transform.child_frame_id = child;
  transform.transform.translation.x = T.translation.x();
  transform.transform.translation.y = T.translation.y();
  transform.transform.translation.z = T.translation.z();
  transform.transform.rotation.x = T.rotation.x();
  transform.transform.rotation.y = T.rotation.y();
  transform.transform.rotation.z = T.rotation.z();
  transform.transform.rotation.w = T.rotation.w();
  tf2_msgs::TFMessage message;
  message.transforms.push_back(transform);
  return message;
}

Rigid3 Shift(double x, double y, double z) { return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(x, y, z)}; }

// Writes messages at their stamp plus a delay of arrival.
class BagWriter {
 public:
  explicit BagWriter(const fs::path& path) { bag_.open(path.string(), rosbag::bagmode::Write); }
  ~BagWriter() { bag_.close(); }

  template <class M>
  void Put(const std::string& topic, const M& message, double arrival) {
    bag_.write(topic, At(arrival), message);
  }
  void PutInfo(const sensor_msgs::CameraInfo& info = Info()) { Put("/camera/camera_info", info, 0.0); }
  void PutImage(double t, sensor_msgs::Image image = RawImage(test::RampImage(), "mono8"), double delay = 0.03) {
    image.header.stamp = At(t);
    Put("/camera/image_raw", image, t + delay);
  }
  void PutOdometry(double t, double x, const std::string& child = "base_footprint", double delay = 0.004) {
    nav_msgs::Odometry odometry;
    odometry.header.stamp = At(t);
    odometry.header.frame_id = "odom";
    odometry.child_frame_id = child;
    odometry.pose.pose.position.x = x;
    odometry.pose.pose.orientation.w = 1.0;
    Put("/odom", odometry, t + delay);
  }
  void PutScan(double t) {
    sensor_msgs::LaserScan scan;
    scan.header.stamp = At(t);
    scan.header.frame_id = "laser_frame";
    scan.angle_min = -1.0F;
    scan.angle_increment = 0.5F;
    scan.range_max = 8.0F;
    scan.ranges = {1.0F, 2.0F, 3.0F};
    Put("/scan", scan, t + 0.01);
  }
  void PutStatic(const std::string& parent, const std::string& child, const Rigid3& T) {
    Put("/tf_static", Tf(parent, child, 0.0, T), 0.0);
  }
  void PutTf(const std::string& parent, const std::string& child, double t, const Rigid3& T) {
    Put("/tf", Tf(parent, child, t, T), t + 0.004);
  }

 private:
  rosbag::Bag bag_;
};

class BagRecording : public ::testing::Test {
 protected:
  fs::path Path() const { return folder_.path() / "drive.bag"; }
  // A bag of a camera alone, plus whatever `more` adds.
  template <class Add>
  fs::path Bag(const Add& more) const {
    BagWriter writer(Path());
    writer.PutInfo();
    more(writer);
    return Path();
  }
  // A robot with static sensors: images at 0.1, 0.2, ..., odometry every 20 ms, scans every 200 ms, for a second.
  fs::path RobotBag() const {
    return Bag([](BagWriter& writer) {
      writer.PutStatic("base_footprint", "camera_optical_frame", Shift(0.1, 0, 1.1));
      writer.PutStatic("base_footprint", "laser_frame", Shift(0, 0, 0.25));
      for (int i = 1; i <= 50; ++i) writer.PutOdometry(0.02 * i, 0.01 * i);
      for (int i = 1; i <= 10; ++i) writer.PutImage(0.1 * i);
      for (int i = 1; i <= 5; ++i) writer.PutScan(0.2 * i);
    });
  }

 private:
  test::TemporaryFolder folder_;
};

TEST_F(BagRecording, ARobotsTopicsComeInStampOrder) {
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

TEST_F(BagRecording, AHandheldBagHasNoBase) {
  const Replay replay = Play(Bag([](BagWriter& writer) { writer.PutImage(0.1); }));
  EXPECT_EQ(replay.order, "i");
  EXPECT_FALSE(replay.info.has_odometry || replay.info.has_laser || replay.info.has_base_transform);
  RecordingOptions options;
  options.require_odometry = true;
  ExpectInError(OpenError(Path(), options), {"drive.bag", "nav_msgs/Odometry", "odom", "base_footprint"});
}

TEST_F(BagRecording, AnEmptyBaseFrameIgnoresWheelsAndLaser) {
  RecordingOptions options;
  options.bag.base_frame = "";
  const Replay replay = Play(RobotBag(), options);
  EXPECT_EQ(replay.order, "iiiiiiiiii");
  EXPECT_FALSE(replay.info.has_odometry || replay.info.has_laser || replay.info.has_base_transform);
}

TEST_F(BagRecording, EveryEncodingBecomesTheSameGrey) {
  const cv::Mat gray = test::RampImage();
  cv::Mat bgr, bgra, wide;
  cv::cvtColor(gray, bgr, cv::COLOR_GRAY2BGR);
  cv::cvtColor(gray, bgra, cv::COLOR_GRAY2BGRA);
  gray.convertTo(wide, CV_16UC1, 256.0);
  cv::Mat padded(gray.rows, gray.cols + 5, CV_8UC1, cv::Scalar(255));
  gray.copyTo(padded.colRange(0, gray.cols));
  sensor_msgs::Image padded_message = RawImage(padded, "mono8");
  padded_message.width = test::kTestWidth;
  cv::Mat swapped = wide.clone();
  for (auto value = swapped.begin<std::uint16_t>(); value != swapped.end<std::uint16_t>(); ++value)
    *value = *value >> 8;
  sensor_msgs::Image big_endian = RawImage(swapped, "mono16");
  big_endian.is_bigendian = 1;
  const std::vector<sensor_msgs::Image> messages{RawImage(gray, "mono8"),
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

TEST_F(BagRecording, BayerPatternsAreNotMixedUp) {
  for (const auto& [encoding, red_x, red_y] : {std::tuple("bayer_rggb8", 0, 0), std::tuple("bayer_bggr8", 1, 1),
                                               std::tuple("bayer_gbrg8", 0, 1), std::tuple("bayer_grbg8", 1, 0)}) {
    cv::Mat red_only(test::kTestHeight, test::kTestWidth, CV_8UC1, cv::Scalar(0));
    for (int y = red_y; y < red_only.rows; y += 2) {
      for (int x = red_x; x < red_only.cols; x += 2) red_only.at<std::uint8_t>(y, x) = 200;
    }
    const Replay replay = Play(Bag([&](BagWriter& writer) { writer.PutImage(0.1, RawImage(red_only, encoding)); }));
    ASSERT_EQ(replay.images.size(), 1U) << replay.error;
    // Pure red is 0.299 of its value in grey.
    EXPECT_NEAR((*replay.images[0].image.image.pixels)[32 * 10 + 10], 60, 1) << encoding;
  }
}

TEST_F(BagRecording, CompressedImagesAreDecodedAndBrokenOnesSkipped) {
  const fs::path path = Bag([](BagWriter& writer) {
    sensor_msgs::CompressedImage image;
    image.format = "png";
    cv::imencode(".png", test::RampImage(), image.data);
    for (int i = 1; i <= 3; ++i) {
      image.header.stamp = At(0.1 * i);
      if (i == 2) image.data.resize(10);
      if (i == 3) cv::imencode(".png", test::RampImage(), image.data);
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

TEST_F(BagRecording, AMovingNeckIsInterpolatedAtTheImagesStamp) {
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

TEST_F(BagRecording, OdometryIsTakenFromTfWhereThereIsNoTopic) {
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

TEST_F(BagRecording, UnusableStampsAreSkippedAndCounted) {
  const Replay replay = Play(Bag([](BagWriter& writer) {
    writer.PutStatic("base_footprint", "camera_optical_frame", Shift(0, 0, 1));
    for (const double t : {0.1, 0.2, 0.2, 0.3}) writer.PutOdometry(t, 0.0);
    writer.PutOdometry(0.15, 0.0, "base_footprint", 0.1);
    writer.PutOdometry(0.4, std::numeric_limits<double>::quiet_NaN());
    writer.PutImage(0.1);
    writer.PutImage(0.1, RawImage(test::RampImage(), "mono8"), 0.2);
    sensor_msgs::Image unstamped = RawImage(test::RampImage(), "mono8");
    writer.Put("/camera/image_raw", unstamped, 0.5);
    writer.PutImage(0.6);
  }));
  EXPECT_EQ(replay.order, "oiooi");
  const std::map<std::string, long> expected{{"odometry stamp not increasing", 2},
                                             {"odometry pose not finite", 1},
                                             {"image stamp not increasing", 1},
                                             {"image stamp zero", 1}};
  EXPECT_EQ(replay.skipped, expected);
}

TEST_F(BagRecording, MessagesFarBehindTheOthersAreSkipped) {
  const Replay replay = Play(Bag([](BagWriter& writer) {
    writer.PutStatic("base_footprint", "camera_optical_frame", Shift(0, 0, 1));
    for (int i = 0; i <= 50; ++i) writer.PutOdometry(0.1 * i, 0.0);
    writer.PutImage(0.05);
    writer.PutImage(0.5, RawImage(test::RampImage(), "mono8"), 3.0);
    writer.PutImage(4.6);
  }));
  EXPECT_EQ(replay.images.size(), 2U);
  EXPECT_EQ(replay.odometry.size(), 51U);
  const std::map<std::string, long> expected{{"image more than 2 s behind the others", 1}};
  EXPECT_EQ(replay.skipped, expected);
}

TEST_F(BagRecording, ImagesOfAnotherSizeOrEncodingAreSkipped) {
  const Replay replay = Play(Bag([](BagWriter& writer) {
    writer.PutImage(0.1);
    writer.PutImage(0.2, RawImage(test::RampImage(16, 12), "mono8"));
    writer.PutImage(0.3, RawImage(test::RampImage(), "32FC1"));
    sensor_msgs::Image cut = RawImage(test::RampImage(), "mono8");
    cut.data.resize(100);
    writer.PutImage(0.4, cut);
    writer.PutImage(0.5);
  }));
  EXPECT_EQ(replay.images.size(), 2U);
  EXPECT_EQ(replay.skipped.at("image of changed size"), 1);
  EXPECT_EQ(replay.skipped.at("image not decodable"), 2);
}

TEST_F(BagRecording, BagsWithoutUsableImagesSaySo) {
  ExpectInError(OpenError(Bag([](BagWriter&) {})), {"drive.bag", "no images", "sensor_msgs/Image"});
  ExpectInError(OpenError(Bag([](BagWriter& w) { w.PutImage(0.1, RawImage(test::RampImage(), "32FC1")); })),
                {"/camera/image_raw", "32FC1"});
  ExpectInError(OpenError(Bag([](BagWriter& w) { w.PutImage(0.1, RawImage(test::RampImage(64, 48), "mono8")); })),
                {"/camera/image_raw", "64x48", "32x24", "/camera/camera_info"});
}

TEST_F(BagRecording, CameraInfoErrorsNameTheTopic) {
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
  for (const char* model : {"rational_polynomial", "equidistant", ""}) {
    info = Info();
    info.distortion_model = model;
    ExpectInError(error(info), {"/camera/camera_info", model, "plumb_bob"});
  }
  info = Info();
  info.D.resize(3);
  ExpectInError(error(info), {"/camera/camera_info", "D has 3"});
  info = Info();
  info.binning_x = 2;
  ExpectInError(error(info), {"/camera/camera_info", "binning"});
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

TEST_F(BagRecording, RectifiedImagesUseTheProjectionMatrix) {
  const Replay replay = Play(Bag([](BagWriter& writer) {
    sensor_msgs::Image image = RawImage(test::RampImage(), "mono8");
    image.header.stamp = At(0.1);
    writer.Put("/camera/image_rect", image, 0.1);
  }));
  EXPECT_EQ(replay.info.camera.fx, 28.0);
  EXPECT_EQ(replay.info.camera.cy, 11.0);
  EXPECT_FALSE(replay.info.camera.distorted());
}

TEST_F(BagRecording, AmbiguousAndWrongTopicsAreNamed) {
  const fs::path path = Bag([](BagWriter& writer) {
    writer.PutImage(0.1);
    writer.Put("/other/image_raw", RawImage(test::RampImage(), "mono8"), 0.2);
    writer.Put("/other/camera_info", Info(), 0.2);
  });
  ExpectInError(OpenError(path), {"several", "/camera/image_raw", "/other/image_raw", "image_topic"});
  RecordingOptions options;
  options.bag.image_topic = "/camera/image_raw";
  EXPECT_EQ(OpenError(path, options), "");
  options.bag.image_topic = "/camera/nothing";
  ExpectInError(OpenError(path, options), {"/camera/nothing", "image_topic", "/other/image_raw"});
  options.bag.image_topic = "/camera/image_raw";
  options.bag.odometry_topic = "/odom";
  ExpectInError(OpenError(path, options), {"/odom", "odometry_topic", "nav_msgs/Odometry"});
}

TEST_F(BagRecording, MissingFramesAreNamedWithTheKnownOnes) {
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
}

TEST_F(BagRecording, FilesThatAreNoBagsAreErrors) {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "x.bag";
  for (const char* text : {"", "#ROSBAG V1.2\n", "hello world, this is no bag"}) {
    test::WriteText(path, text);
    ExpectInError(OpenError(path), {"x.bag", "#ROSBAG V2.0"});
  }
  RecordingOptions options;
  options.odometry_file = "odometry.csv";
  ExpectInError(OpenError(RobotBag(), options), {"drive.bag", "dataset folder"});
}

TEST_F(BagRecording, TruncatedAndDamagedBagsAreErrorsNotCrashes) {
  std::ifstream stream(RobotBag(), std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "cut.bag";
  for (const double share : {0.001, 0.3, 0.7, 0.95, 0.999}) {
    test::WriteText(path, whole.substr(0, static_cast<std::size_t>(share * static_cast<double>(whole.size()))));
    ExpectInError(OpenError(path), {"cut.bag"});
  }
  // A bag that was never closed: no index position in its header.
  std::string unindexed = whole;
  const std::size_t position = unindexed.find("index_pos=");
  std::fill_n(unindexed.begin() + static_cast<std::ptrdiff_t>(position) + 10, 8, '\0');
  test::WriteText(path, unindexed);
  ExpectInError(OpenError(path), {"cut.bag", "no index", "reindex"});
}

}  // namespace
}  // namespace planar_vslam
