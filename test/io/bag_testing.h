#pragma once
// Small bags for the tests.
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/LaserScan.h>
#include <tf2_msgs/TFMessage.h>
#include <unistd.h>

#include <cmath>
#include <string>

#include "bag_cdr.h"
#include "bag_sink.h"
#include "recording_testing.h"
#include "support/support.h"

namespace planar_vslam::test {

constexpr double kEpoch = 1'700'000'000.0;  // s

inline ros::Time At(double seconds) {
  return ros::Time().fromNSec(static_cast<std::uint64_t>(std::llround((kEpoch + seconds) * 1e3)) * 1'000'000U);
}
inline Timestamp StampAt(double seconds) { return {static_cast<std::int64_t>(At(seconds).toNSec())}; }

inline sensor_msgs::CameraInfo Info() {
  sensor_msgs::CameraInfo info;
  info.width = kTestWidth;
  info.height = kTestHeight;
  info.distortion_model = "plumb_bob";
  info.D = {0.1, -0.2, 0.001, 0.002, 0.03};
  info.K = {30, 0, 16, 0, 31, 12, 0, 0, 1};
  info.P = {28, 0, 15, 0, 0, 29, 11, 0, 0, 0, 1, 0};
  return info;
}

inline sensor_msgs::Image RawImage(const cv::Mat& pixels, const std::string& encoding) {
  sensor_msgs::Image image;
  image.header.frame_id = "camera_optical_frame";
  image.width = static_cast<std::uint32_t>(pixels.cols);
  image.height = static_cast<std::uint32_t>(pixels.rows);
  image.encoding = encoding;
  image.step = static_cast<std::uint32_t>(pixels.step[0]);
  image.data.assign(pixels.datastart, pixels.dataend);
  return image;
}

inline tf2_msgs::TFMessage Tf(const std::string& parent, const std::string& child, double t, const Rigid3& T) {
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

inline Rigid3 Shift(double x, double y, double z) { return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(x, y, z)}; }

// Writes messages at their stamp plus a delay of arrival.
class BagWriter {
 public:
  // By the end of its name a recording of ROS 2 or a rosbag.
  explicit BagWriter(const std::filesystem::path& path) : BagWriter(io::CreateSink(path)) {
    if (sink_ == nullptr) bag_.open(path.string(), rosbag::bagmode::Write);
  }
  explicit BagWriter(std::unique_ptr<io::MessageSink> sink) : sink_(std::move(sink)) {}
  ~BagWriter() { sink_ == nullptr ? bag_.close() : sink_->Close(); }

  template <class M>
  void Put(const std::string& topic, const M& message, double arrival) {
    if (sink_ == nullptr) {
      bag_.write(topic, At(arrival), message);
    } else {
      io::CdrWriter writer;
      writer(message);
      PutBytes(topic, ros::message_traits::datatype<M>(), writer.bytes(), arrival);
    }
  }
  // Not into a rosbag.
  void PutBytes(const std::string& topic, const std::string& type, const std::string& bytes, double arrival) {
    sink_->Write(topic, type, StampAt(arrival).nanoseconds, bytes);
  }
  void PutInfo(const sensor_msgs::CameraInfo& info = Info()) { Put("/camera/camera_info", info, 0.0); }
  void PutImage(double t, sensor_msgs::Image image = RawImage(RampImage(), "mono8"), double delay = 0.03) {
    image.header.stamp = At(t);
    Put("/camera/image_raw", image, t + delay);
  }
  void PutOdometry(double t, double x, const std::string& child = "base_footprint", double delay = 0.004,
                   nav_msgs::Odometry odometry = {}) {
    odometry.pose.pose.orientation.w = 1.0;
    PutOdometryAsIs(t, x, odometry, child, delay);
  }
  // With the orientation that `odometry` has.
  void PutOdometryAsIs(double t, double x, nav_msgs::Odometry odometry, const std::string& child = "base_footprint",
                       double delay = 0.004) {
    odometry.header.stamp = At(t);
    odometry.header.frame_id = "odom";
    odometry.child_frame_id = child;
    odometry.pose.pose.position.x = x;
    Put("/odom", odometry, t + delay);
  }
  void PutScan(double t, double delay = 0.01, const std::string& frame = "laser_frame") {
    sensor_msgs::LaserScan scan;
    scan.header.stamp = At(t);
    scan.header.frame_id = frame;
    scan.angle_min = -1.0F;
    scan.angle_increment = 0.5F;
    scan.range_max = 8.0F;
    scan.ranges = {1.0F, 2.0F, 3.0F};
    Put("/scan", scan, t + delay);
  }
  void PutStatic(const std::string& parent, const std::string& child, const Rigid3& T) {
    Put("/tf_static", Tf(parent, child, 0.0, T), 0.0);
  }
  void PutTf(const std::string& parent, const std::string& child, double t, const Rigid3& T, double delay = 0.004) {
    Put("/tf", Tf(parent, child, t, T), t + delay);
  }

 private:
  std::unique_ptr<io::MessageSink> sink_;
  rosbag::Bag bag_;
};

// While it lives, whoever runs the tests, root too, may not write a file and its folder, and read it as `file` says.
class AsReader {
 public:
  explicit AsReader(const std::filesystem::path& path, std::filesystem::perms file = kAllRead)
      : folder_(path.parent_path()) {
    std::filesystem::permissions(path, file);
    std::filesystem::permissions(folder_, kAllRead | kAllSearch);
    constexpr uid_t kNobody = 65534;
    was_root_ = geteuid() == 0 && seteuid(kNobody) == 0;
    std::error_code ignored;
    works_ = geteuid() != 0 && std::filesystem::exists(path, ignored);
  }
  ~AsReader() {
    const bool back = !was_root_ || seteuid(0) == 0;
    EXPECT_TRUE(back);
    std::filesystem::permissions(folder_, std::filesystem::perms::owner_all);
  }
  // False for root that cannot be anybody else, and below a folder that only root may enter.
  bool works() const { return works_; }
  AsReader(const AsReader&) = delete;
  AsReader& operator=(const AsReader&) = delete;

 private:
  static constexpr auto kAllRead =
      std::filesystem::perms::owner_read | std::filesystem::perms::group_read | std::filesystem::perms::others_read;
  static constexpr auto kAllSearch =
      std::filesystem::perms::owner_exec | std::filesystem::perms::group_exec | std::filesystem::perms::others_exec;
  std::filesystem::path folder_;
  bool was_root_ = false, works_ = false;
};

// Each of its tests runs with every kind of file: what is right for one is right for all.
class BagFixture : public ::testing::TestWithParam<const char*> {
 protected:
  std::filesystem::path Path() const { return folder_.path() / (std::string("drive") + GetParam()); }
  // A bag of a camera alone, plus whatever `more` adds.
  template <class Add>
  std::filesystem::path Bag(const Add& more) const {
    BagWriter writer(Path());
    writer.PutInfo();
    more(writer);
    return Path();
  }
  // A robot with static sensors: images at 0.1, 0.2, ..., odometry every 20 ms, scans every 200 ms, for a second.
  std::filesystem::path RobotBag() const {
    return Bag([](BagWriter& writer) {
      writer.PutStatic("base_footprint", "camera_optical_frame", Shift(0.1, 0, 1.1));
      writer.PutStatic("base_footprint", "laser_frame", Shift(0, 0, 0.25));
      for (int i = 1; i <= 50; ++i) writer.PutOdometry(0.02 * i, 0.01 * i);
      for (int i = 1; i <= 10; ++i) writer.PutImage(0.1 * i);
      for (int i = 1; i <= 5; ++i) writer.PutScan(0.2 * i);
    });
  }

 private:
  TemporaryFolder folder_;
};

#define PV_WITH_EVERY_KIND_OF_BAG(Suite)                                            \
  INSTANTIATE_TEST_SUITE_P(Bags, Suite, ::testing::Values(".bag", ".mcap", ".db3"), \
                           [](const auto& kind) { return std::string(kind.param).substr(1); })

}  // namespace planar_vslam::test
