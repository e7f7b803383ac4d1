// Quality and events, frame by frame.
#include "robot_state.h"

#include <gtest/gtest.h>

#include <limits>

namespace planar_vslam::ros_face {
namespace {

constexpr int kMinInliers = 25;

// A frame of a robot whose odometry says `T_odom_base`.
FrameReport At(const Rigid2& T_map_base, const Rigid2& T_odom_base) {
  FrameReport frame;
  frame.state = TrackingState::kTracking;
  frame.metric = true;
  frame.inliers = 100;
  frame.covariance = 1e-6 * Matrix6d::Identity();
  frame.T_map_base = Embed3(T_map_base);
  frame.T_map_odom = T_map_base * T_odom_base.Inverse();
  return frame;
}

std::vector<std::string> Kinds(const std::vector<RobotEvent>& events) {
  std::vector<std::string> kinds;
  for (const RobotEvent& event : events) kinds.push_back(event.kind);
  return kinds;
}

TEST(Quality, FallsWithUncertaintyFromOneToZero) {
  FrameReport frame = At({}, {});
  EXPECT_GT(Quality(frame), 0.99);
  frame.covariance(1, 1) = 0.01;  // 0.1 m
  EXPECT_NEAR(Quality(frame), 0.5, 1e-9);
  frame.covariance(5, 5) = 0.03;
  EXPECT_NEAR(Quality(frame), 0.25, 1e-9) << "the worse of both";
  frame.covariance(0, 0) = std::numeric_limits<double>::quiet_NaN();
  frame.covariance(5, 5) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(Quality(frame), 0.0);
  EXPECT_EQ(Quality(FrameReport()), 0.0) << "no pose";
}

TEST(LocalisedBy, SaysWhatTellsThePose) {
  FrameReport frame = At({}, {});
  EXPECT_EQ(LocalisedBy(frame, kMinInliers), "camera");
  frame.inliers = 3;
  EXPECT_EQ(LocalisedBy(frame, kMinInliers), "laser");
  frame.state = TrackingState::kOdometry;
  EXPECT_EQ(LocalisedBy(frame, kMinInliers), "odometry");
  frame.state = TrackingState::kLost;
  EXPECT_EQ(LocalisedBy(frame, kMinInliers), "nothing");
}

TEST(EventFinder, AJumpIsWhatOdometryDoesNotExplain) {
  EventFinder finder;
  EXPECT_TRUE(finder.OnFrame(At({0, 0, 0}, {50, 20, 1}), 0).empty());
  EXPECT_TRUE(finder.OnFrame(At({1, 0, 0}, Rigid2(50, 20, 1) * Rigid2(1, 0, 0)), 0).empty()) << "driven";
  // Far from odometry's origin a small turn moves that by a lot, the robot by nothing.
  EXPECT_TRUE(finder.OnFrame(At({1, 0, 0.02}, Rigid2(50, 20, 1) * Rigid2(1, 0, 0)), 0).empty());
  const auto events = finder.OnFrame(At({1.5, 0, 0.02}, Rigid2(50, 20, 1) * Rigid2(1, 0, 0)), 0);
  EXPECT_EQ(Kinds(events), std::vector<std::string>{"jump"});
  EXPECT_NE(events.front().text.find("0.50 m"), std::string::npos) << events.front().text;
  finder.OnRestart();
  EXPECT_TRUE(finder.OnFrame(At({9, 9, 3}, {}), 0).empty());
}

TEST(EventFinder, EachThingIsSaidOnce) {
  EventFinder finder;
  FrameReport frame = At({}, {});
  frame.odometry_rejected = true;
  EXPECT_EQ(Kinds(finder.OnFrame(frame, 1)), (std::vector<std::string>{"slip", "loop"}));
  EXPECT_TRUE(finder.OnFrame(frame, 1).empty());
  frame.odometry_rejected = false;
  frame.state = TrackingState::kLost;
  EXPECT_EQ(Kinds(finder.OnFrame(frame, 1)), std::vector<std::string>{"lost"});
  EXPECT_TRUE(finder.OnFrame(frame, 1).empty());
  frame.state = TrackingState::kRelocalized;
  EXPECT_EQ(Kinds(finder.OnFrame(frame, 1)), std::vector<std::string>{"relocalised"});
}

}  // namespace
}  // namespace planar_vslam::ros_face
