// Queue and tracking loop between two threads, without a running ROS: a robot drives along a textured wall and looks at
// it sideways, which shifts the picture by whole pixels.
#include "tracking_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <chrono>
#include <cmath>
#include <future>
#include <random>
#include <thread>

#include "planar_vslam/io/message_values.h"

namespace planar_vslam::ros_face {
namespace {

constexpr int kWidth = 480, kHeight = 360, kPixelsPerImage = 2, kImages = 60;
constexpr double kFocalLength = 400.0;                                    // px
constexpr double kWallDistance = 2.0;                                     // m
constexpr double kStep = kPixelsPerImage * kWallDistance / kFocalLength;  // m between images
constexpr int kWallWidth = kWidth + kImages * kPixelsPerImage;            // px
constexpr double kPeriod = 0.05;                                          // s between images

class Wall {
 public:
  Wall() : pixels_(static_cast<std::size_t>(kWallWidth) * kHeight, 128) {
    std::mt19937 generator(1);
    const auto below = [&generator](int end) { return static_cast<int>(generator() % static_cast<unsigned>(end)); };
    for (int i = 0; i < 900; ++i) {
      const int left = below(kWallWidth), top = below(kHeight), side = 4 + below(30);
      const auto grey = static_cast<std::uint8_t>(below(256));
      for (int y = top; y < std::min(top + side, kHeight); ++y) {
        std::fill(At(left, y), At(std::min(left + side, kWallWidth), y), grey);
      }
    }
  }
  // The part that starts at column `left`.
  std::vector<std::uint8_t> View(int left) {
    std::vector<std::uint8_t> view;
    for (int y = 0; y < kHeight; ++y) view.insert(view.end(), At(left, y), At(left + kWidth, y));
    return view;
  }

 private:
  std::vector<std::uint8_t>::iterator At(int x, int y) {
    return pixels_.begin() + static_cast<std::ptrdiff_t>(y) * kWallWidth + x;
  }
  std::vector<std::uint8_t> pixels_;
};

ros::Time StampOf(int image) { return ros::Time(100.0) + ros::Duration(kPeriod * image); }

Input CameraInfo() {
  const auto info = boost::make_shared<sensor_msgs::CameraInfo>();
  info->width = kWidth;
  info->height = kHeight;
  info->distortion_model = "plumb_bob";
  info->D.assign(5, 0.0);
  info->K = {kFocalLength, 0.0, kWidth / 2.0, 0.0, kFocalLength, kHeight / 2.0, 0.0, 0.0, 1.0};
  info->P = {kFocalLength, 0.0, kWidth / 2.0, 0.0, 0.0, kFocalLength, kHeight / 2.0, 0.0, 0.0, 0.0, 1.0, 0.0};
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
  odometry->pose.pose.position.x = kStep * image;
  odometry->pose.pose.orientation.w = 1.0;
  return nav_msgs::OdometryConstPtr(odometry);
}

Input ImageAt(int number, Wall* wall) {
  const auto image = boost::make_shared<sensor_msgs::Image>();
  image->header.stamp = StampOf(number);
  image->header.frame_id = "camera";
  image->width = kWidth;
  image->height = kHeight;
  image->step = kWidth;
  image->encoding = "mono8";
  image->data = wall->View(kPixelsPerImage * number);
  return sensor_msgs::ImageConstPtr(image);
}

std::optional<MapSnapshot> SnapshotOf(const TrackingLoop& loop, InputQueue* queue) {
  std::promise<std::optional<MapSnapshot>> answer;
  queue->Push(Command([&] { answer.set_value(loop.Snapshot()); }));
  return answer.get_future().get();
}

TEST(TrackingLoop, TracksAndMapsOnThreadsOfItsOwn) {
  ros::Time::init();
  NodeSettings settings;
  const std::string& base_frame = settings.pipeline.topics.base_frame;
  std::promise<void> last_image_done;
  std::vector<FrameReport> reports;
  const auto on_frame = [&](const FrameReport& report, const std::optional<Rigid2>&) {
    reports.push_back(report);
    if (reports.size() == kImages) last_image_done.set_value();
  };
  TrackingLoop loop(settings, "image", {on_frame, [] {}});
  InputQueue queue(kImages, false);
  std::thread tracking([&] {
    while (const std::optional<Input> input = queue.Pop()) loop.Handle(*input);
  });

  Wall wall;
  queue.Push(CameraTransform(base_frame));
  queue.Push(CameraInfo());
  for (int i = 0; i < kImages; ++i) {
    queue.Push(OdometryAt(i, base_frame));
    queue.Push(ImageAt(i, &wall));
    // As a service does: taken there, read here while tracking and mapping go on.
    if (i % 10 != 0) continue;
    const std::optional<MapSnapshot> snapshot = SnapshotOf(loop, &queue);
    EXPECT_TRUE(!snapshot.has_value() || Validate(*snapshot->map).empty());
  }
  constexpr auto kPatience = std::chrono::minutes(2);  // only where something hangs
  const std::future_status status = last_image_done.get_future().wait_for(kPatience);
  const std::optional<MapSnapshot> snapshot = SnapshotOf(loop, &queue);
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
  const double driven = kStep / kPeriod * SecondsBetween(start, reports.back().stamp);
  const Eigen::Vector3d error = reports.back().T_map_base->translation - driven * Eigen::Vector3d::UnitX();
  EXPECT_LT(error.norm(), 0.02) << error.transpose();
}

}  // namespace
}  // namespace planar_vslam::ros_face
