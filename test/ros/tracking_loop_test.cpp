// Queue and tracking loop between two threads, without a running ROS.
#include "tracking_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <chrono>
#include <cmath>
#include <future>
#include <thread>

#include "planar_vslam/io/message_values.h"
#include "support/wall_drive.h"

namespace planar_vslam::ros_face {
namespace {

using test::WallDrive;

constexpr int kImages = 60;
constexpr double kPeriod = 1e-9 * static_cast<double>(WallDrive::kPeriod);  // s between images

ros::Time StampOf(int image) { return ros::Time(100.0) + ros::Duration(kPeriod * image); }

Input CameraInfo() {
  const auto info = boost::make_shared<sensor_msgs::CameraInfo>();
  info->width = WallDrive::kWidth;
  info->height = WallDrive::kHeight;
  info->distortion_model = "plumb_bob";
  info->D.assign(5, 0.0);
  info->K = {WallDrive::kFocalLength,
             0.0,
             WallDrive::kWidth / 2.0,
             0.0,
             WallDrive::kFocalLength,
             WallDrive::kHeight / 2.0,
             0.0,
             0.0,
             1.0};
  info->P = {WallDrive::kFocalLength,
             0.0,
             WallDrive::kWidth / 2.0,
             0.0,
             0.0,
             WallDrive::kFocalLength,
             WallDrive::kHeight / 2.0,
             0.0,
             0.0,
             0.0,
             1.0,
             0.0};
  return sensor_msgs::CameraInfoConstPtr(info);
}

// The camera half a metre up, looking to the robot's left: x forward, y down.
Input CameraTransform(const std::string& base_frame) {
  const auto message = boost::make_shared<tf2_msgs::TFMessage>();
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = base_frame;
  transform.child_frame_id = "camera";
  transform.transform.translation.z = 0.5;
  transform.transform.rotation.x = -std::sqrt(0.5);
  transform.transform.rotation.w = std::sqrt(0.5);
  message->transforms.push_back(transform);
  return TfInput{message, true};
}

Input OdometryAt(int image, const std::string& base_frame) {
  const auto odometry = boost::make_shared<nav_msgs::Odometry>();
  odometry->header.stamp = StampOf(image);
  odometry->child_frame_id = base_frame;
  odometry->pose.pose.position.x = WallDrive::kStep * image;
  odometry->pose.pose.orientation.w = 1.0;
  return nav_msgs::OdometryConstPtr(odometry);
}

Input ImageAt(int number, const WallDrive& drive) {
  const auto image = boost::make_shared<sensor_msgs::Image>();
  image->header.stamp = StampOf(number);
  image->header.frame_id = "camera";
  image->width = WallDrive::kWidth;
  image->height = WallDrive::kHeight;
  image->step = WallDrive::kWidth;
  image->encoding = "mono8";
  image->data = drive.View(number);
  return sensor_msgs::ImageConstPtr(image);
}

std::optional<EstimatorSnapshot> SnapshotOf(const TrackingLoop& loop, InputQueue* queue) {
  std::promise<std::optional<EstimatorSnapshot>> answer;
  queue->Push(Command([&] { answer.set_value(loop.Snapshot()); }));
  return answer.get_future().get();
}

TEST(TrackingLoop, TracksAndMapsOnThreadsOfItsOwn) {
  ros::Time::init();
  NodeSettings settings;
  const std::string& base_frame = settings.pipeline.topics.base_frame;
  std::promise<void> last_image_done;
  std::vector<FrameReport> reports;
  const auto on_frame = [&](const FrameReport& report) {
    reports.push_back(report);
    if (reports.size() == kImages) last_image_done.set_value();
  };
  TrackingLoop loop(settings, "image", {on_frame, [] {}, [](const std::string&) {}});
  InputQueue queue(kImages, false);
  std::thread tracking([&] {
    while (const std::optional<Input> input = queue.Pop()) loop.Handle(*input);
  });

  const WallDrive drive(kImages);
  queue.Push(CameraTransform(base_frame));
  queue.Push(CameraInfo());
  for (int i = 0; i < kImages; ++i) {
    queue.Push(OdometryAt(i, base_frame));
    queue.Push(ImageAt(i, drive));
    // As a service does: taken there, read here while tracking and mapping go on.
    if (i % 10 != 0) continue;
    const std::optional<EstimatorSnapshot> snapshot = SnapshotOf(loop, &queue);
    EXPECT_TRUE(!snapshot.has_value() || Validate(*snapshot->map).empty());
  }
  constexpr auto kPatience = std::chrono::minutes(2);  // only where something hangs
  const std::future_status status = last_image_done.get_future().wait_for(kPatience);
  const std::optional<EstimatorSnapshot> snapshot = SnapshotOf(loop, &queue);
  queue.Close();
  tracking.join();

  ASSERT_EQ(status, std::future_status::ready) << loop.waiting_for();
  EXPECT_TRUE(queue.dropped().empty());
  ASSERT_TRUE(snapshot.has_value());
  EXPECT_TRUE(snapshot->map->metric);
  EXPECT_GE(snapshot->map->keyframes.size(), 2U);
  EXPECT_EQ(reports.back().state, TrackingState::kTracking);
  // The map starts where the first keyframe is.
  const Timestamp start = (*snapshot->map->keyframes.begin()).second.stamp;
  const double driven = WallDrive::kStep / kPeriod * SecondsBetween(start, reports.back().stamp);
  const Eigen::Vector3d error = reports.back().T_map_base->translation - driven * Eigen::Vector3d::UnitX();
  EXPECT_LT(error.norm(), 0.02) << error.transpose();
}

}  // namespace
}  // namespace planar_vslam::ros_face
