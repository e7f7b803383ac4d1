// CDR against bytes put together by hand from its rules, and against itself.
#include "bag_cdr.h"

#include <gtest/gtest.h>

#include "bag_message.h"

namespace planar_vslam::io {
namespace {

template <class M>
std::string Encoded(const M& message, bool big_endian = false) {
  CdrWriter writer(big_endian);
  writer(message);
  return writer.bytes();
}

template <class M>
M Decoded(const std::string& bytes) {
  M message;
  CdrReader reader(bytes);
  reader(message);
  return message;
}

std_msgs::Header SomeHeader() {
  std_msgs::Header header;
  header.stamp = ros::Time(0x01020304, 0x05060708);
  header.frame_id = "cam";
  return header;
}

std::string Bytes(std::initializer_list<int> numbers) {
  std::string bytes;
  for (const int number : numbers) bytes.push_back(static_cast<char>(number));
  return bytes;
}

TEST(Cdr, AHeaderIsStampAndTextBehindItsLength) {
  const std::string little = Bytes({0, 1, 0, 0, 4, 3, 2, 1, 8, 7, 6, 5, 4, 0, 0, 0, 'c', 'a', 'm', 0});
  const std::string big = Bytes({0, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 0, 0, 0, 4, 'c', 'a', 'm', 0});
  EXPECT_EQ(Encoded(SomeHeader()), little);
  EXPECT_EQ(Encoded(SomeHeader(), true), big);
  for (const std::string& bytes : {little, big}) {
    const auto header = Decoded<std_msgs::Header>(bytes);
    EXPECT_EQ(header.stamp, SomeHeader().stamp);
    EXPECT_EQ(header.frame_id, "cam");
  }
}

// Padding counts from behind the first four bytes.
TEST(Cdr, NumbersLieAtMultiplesOfTheirSize) {
  geometry_msgs::TransformStamped message;
  message.header = SomeHeader();
  message.child_frame_id = "b";
  message.transform.translation.x = 1.0;
  const std::string bytes = Encoded(message);
  // 12 + "cam" = 16, 4 + "b" = 22, then 2 of padding to 24: x is a double.
  const std::string x = Bytes({0, 0, 0, 0, 0, 0, 0xf0, 0x3f});
  EXPECT_EQ(bytes.substr(4 + 16, 12), Bytes({2, 0, 0, 0, 'b', 0, 0, 0}) + x.substr(0, 4));
  EXPECT_EQ(bytes.substr(4 + 24, 8), x);
  EXPECT_EQ(bytes.size(), 4U + 24U + 7U * 8U);
}

TEST(Cdr, EveryTypeComesBackInBothByteOrders) {
  for (const bool big_endian : {false, true}) {
    sensor_msgs::Image image;
    image.header = SomeHeader();
    image.height = 2, image.width = 3, image.step = 3, image.encoding = "mono8", image.is_bigendian = 1;
    image.data = {1, 2, 3, 4, 5, 6};
    EXPECT_EQ(Decoded<sensor_msgs::Image>(Encoded(image, big_endian)), image);
    sensor_msgs::CompressedImage compressed;
    compressed.header = SomeHeader(), compressed.format = "jpeg", compressed.data = {9, 8, 7};
    EXPECT_EQ(Decoded<sensor_msgs::CompressedImage>(Encoded(compressed, big_endian)), compressed);
    sensor_msgs::CameraInfo info;
    info.header = SomeHeader(), info.distortion_model = "plumb_bob", info.D = {0.1, 0.2, 0.3, 0.4, 0.5};
    info.height = 480, info.width = 640, info.K[4] = 31.0, info.R[8] = 1.0, info.P[11] = 7.0;
    info.binning_x = 2, info.binning_y = 4, info.roi.x_offset = 1, info.roi.y_offset = 2;
    info.roi.height = 3, info.roi.width = 5, info.roi.do_rectify = 1;
    EXPECT_EQ(Decoded<sensor_msgs::CameraInfo>(Encoded(info, big_endian)), info);
    sensor_msgs::LaserScan scan;
    scan.header = SomeHeader(), scan.angle_min = -1.0F, scan.angle_max = 1.0F, scan.angle_increment = 0.5F;
    scan.time_increment = 0.1F, scan.scan_time = 0.2F, scan.range_min = 0.3F, scan.range_max = 8.0F;
    scan.ranges = {1.0F, 2.0F, 3.0F}, scan.intensities = {4.0F};
    EXPECT_EQ(Decoded<sensor_msgs::LaserScan>(Encoded(scan, big_endian)), scan);
    nav_msgs::Odometry odometry;
    odometry.header = SomeHeader(), odometry.child_frame_id = "base", odometry.pose.pose.position.y = 2.0;
    odometry.pose.pose.orientation.w = 1.0, odometry.pose.covariance[35] = 0.5;
    odometry.twist.twist.linear.x = 0.3, odometry.twist.twist.angular.z = 0.4, odometry.twist.covariance[0] = 0.6;
    EXPECT_EQ(Decoded<nav_msgs::Odometry>(Encoded(odometry, big_endian)), odometry);
    tf2_msgs::TFMessage tf;
    tf.transforms.resize(2);
    tf.transforms[1].header = SomeHeader(), tf.transforms[1].child_frame_id = "c";
    tf.transforms[1].transform.rotation.w = 1.0;
    EXPECT_EQ(Decoded<tf2_msgs::TFMessage>(Encoded(tf, big_endian)), tf);
  }
}

TEST(Cdr, BytesThatEndEarlyAreCutShort) {
  tf2_msgs::TFMessage tf;
  tf.transforms.resize(2);
  tf.transforms[0].header = SomeHeader();
  const std::string whole = Encoded(tf);
  for (std::size_t length = 0; length < whole.size(); ++length) {
    EXPECT_THROW(Decoded<tf2_msgs::TFMessage>(whole.substr(0, length)), DamagedMessage) << length;
  }
}

TEST(Cdr, CountsBeyondTheBytesAreCutShort) {
  for (const int high : {0x00, 0x10, 0x7f, 0xff}) {
    const std::string count = Bytes({0xff, 0xff, 0xff, high});
    const std::string empty_header = Bytes({0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
    EXPECT_THROW(Decoded<tf2_msgs::TFMessage>(Bytes({0, 1, 0, 0}) + count), DamagedMessage);
    EXPECT_THROW(Decoded<sensor_msgs::CompressedImage>(empty_header + count), DamagedMessage);
    EXPECT_THROW(Decoded<sensor_msgs::CompressedImage>(empty_header + Bytes({0, 0, 0, 0}) + count), DamagedMessage);
  }
}

TEST(Cdr, TextsMayComeWithoutTheirLastZero) {
  const std::string header = Bytes({0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0});
  EXPECT_EQ(Decoded<std_msgs::Header>(header + Bytes({0, 0, 0, 0})).frame_id, "");
  EXPECT_EQ(Decoded<std_msgs::Header>(header + Bytes({1, 0, 0, 0, 'm'})).frame_id, "m");
}

TEST(Cdr, ATimeBefore1970IsNone) {
  const std::string header = Bytes({0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 2, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_TRUE(Decoded<std_msgs::Header>(header).stamp.isZero());
}

TEST(Cdr, OtherRepresentationsAreRefused) {
  for (const int kind : {2, 3, 7}) {
    EXPECT_THROW(CdrReader(Bytes({0, kind, 0, 0})), DamagedMessage);
  }
  EXPECT_THROW(CdrReader(Bytes({1, 0, 0, 0})), DamagedMessage);
}

}  // namespace
}  // namespace planar_vslam::io
