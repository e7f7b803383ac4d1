// Queue and tracking loop between two threads, without a running ROS.
#include "tracking_loop.h"

#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <thread>

#include "tracking_loop_testing.h"

namespace planar_vslam::ros_face {
namespace {

constexpr int kImages = 60;

std::optional<EstimatorSnapshot> SnapshotOf(const TrackingLoop& loop, InputQueue* queue) {
  std::promise<std::optional<EstimatorSnapshot>> answer;
  queue->Push(Command([&] { answer.set_value(loop.Snapshot()); }));
  return answer.get_future().get();
}

TEST(TrackingLoop, TracksAndMapsOnThreadsOfItsOwn) {
  ros::Time::init();
  NodeSettings settings;
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

  queue.Push(CameraTransform());
  queue.Push(CameraInfo());
  for (int i = 0; i < kImages; ++i) {
    queue.Push(OdometryAt(i));
    queue.Push(ImageAt(i));
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
  constexpr double kPeriod = 1e-9 * static_cast<double>(WallDrive::kPeriod);  // s between images
  const double driven = WallDrive::kStep / kPeriod * SecondsBetween(start, reports.back().stamp);
  const Eigen::Vector3d error = reports.back().T_map_base->translation - driven * Eigen::Vector3d::UnitX();
  EXPECT_LT(error.norm(), 0.02) << error.transpose();
}

}  // namespace
}  // namespace planar_vslam::ros_face
