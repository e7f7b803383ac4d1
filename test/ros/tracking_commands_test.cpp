// What users tell the tracking loop: what it does then, and what it refuses.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "tracking_loop.h"
#include "tracking_loop_testing.h"

namespace planar_vslam::ros_face {
namespace {

constexpr int kImages = 40;  // of a drive that makes a map
using Pose = geometry_msgs::PoseWithCovarianceStamped;

Pose StartAt(double x) {
  Pose pose;
  pose.header.frame_id = "map";
  pose.pose.pose.position.x = x;
  pose.pose.pose.orientation.w = 1.0;
  for (const std::size_t planar : {0U, 7U, 35U}) pose.pose.covariance[planar] = 0.01;  // x, y, yaw
  return pose;
}

SavedMap Save(const Robot& robot) {
  const EstimatorSnapshot snapshot = *robot.loop.Snapshot();
  return {*snapshot.map, snapshot.camera};
}

class TrackingCommands : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { ros::Time::init(); }
  TrackingCommands() {
    robot.Begin();
    robot.Drive(0, kImages);
  }
  Robot robot;
};

TEST_F(TrackingCommands, AreRefusedWhileTheCameraIsNotKnown) {
  Robot blind;
  for (const Expected<bool>& result :
       {blind.loop.LoadMap(Save(robot)), blind.loop.SetMode(RunMode::kLocalization), blind.loop.StartAt(StartAt(0.0)),
        blind.loop.AdjustMap(), blind.loop.FindPlaceAnew()}) {
    ASSERT_FALSE(result.ok());
    EXPECT_NE(result.error().message.find("camera_info"), std::string::npos) << result.error().message;
  }
}

TEST_F(TrackingCommands, AreRefusedWhileThereIsNoMap) {
  Robot begun;
  begun.Begin();
  EXPECT_FALSE(begun.loop.SetMode(RunMode::kLocalization).ok());
  EXPECT_FALSE(begun.loop.StartAt(StartAt(0.0)).ok());
  EXPECT_FALSE(begun.loop.AdjustMap().ok());
  EXPECT_EQ(begun.loop.mode(), RunMode::kMapping);
}

TEST_F(TrackingCommands, ALoadedMapIsTrackedIn) {
  Robot other;
  other.Begin();
  ASSERT_TRUE(other.loop.LoadMap(Save(robot)).ok());
  EXPECT_EQ(other.restarts, 1);
  ASSERT_TRUE(other.loop.SetMode(RunMode::kLocalization).ok());
  ASSERT_TRUE(other.loop.StartAt(StartAt(0.0)).ok());
  other.Drive(0, kImages);
  EXPECT_TRUE(other.Tracks());
  EXPECT_EQ(other.loop.map()->keyframes.size(), robot.loop.map()->keyframes.size());
}

TEST_F(TrackingCommands, AMapThatDoesNotFitChangesNothing) {
  SavedMap wrong = Save(robot);
  wrong.map.octave_scales.pop_back();
  const auto map = robot.loop.map();
  EXPECT_FALSE(robot.loop.LoadMap(wrong).ok());
  EXPECT_FALSE(robot.loop.LoadMap(SavedMap{}).ok());
  EXPECT_EQ(robot.loop.map(), map);
  EXPECT_EQ(robot.restarts, 0);
  robot.Drive(kImages, kImages + 5);
  EXPECT_TRUE(robot.Tracks());
}

TEST_F(TrackingCommands, StartsThatAreNoPlaceAreRefused) {
  std::vector<Pose> bad(6, StartAt(0.0));
  bad[0].header.frame_id = "odom";
  bad[1].pose.pose.orientation.w = 0.0;
  bad[2].pose.pose.position.y = std::numeric_limits<double>::quiet_NaN();
  bad[3].pose.covariance[0] = -1.0;
  bad[4].pose.covariance[35] = std::numeric_limits<double>::infinity();
  bad[5].pose.pose.position.x = 1e6;
  for (const Pose& pose : bad) {
    const Expected<bool> result = robot.loop.StartAt(pose);
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().message.find('\n'), std::string::npos);
  }
  Pose slash = StartAt(0.3);
  slash.header.frame_id = "/map";
  EXPECT_TRUE(robot.loop.StartAt(slash).ok());
}

TEST_F(TrackingCommands, APlaceIsForgottenOnlyWhereTheMapStays) {
  EXPECT_FALSE(robot.loop.FindPlaceAnew().ok());
  robot.Drive(kImages, kImages + 5);
  EXPECT_TRUE(robot.Tracks());
  ASSERT_TRUE(robot.loop.SetMode(RunMode::kLocalization).ok());
  const std::size_t keyframes = robot.loop.map()->keyframes.size();
  ASSERT_TRUE(robot.loop.FindPlaceAnew().ok());
  EXPECT_EQ(robot.restarts, 0) << "the map is still the map";
  EXPECT_EQ(robot.loop.map()->keyframes.size(), keyframes);
  robot.Handle(OdometryAt(kImages + 5));
  robot.Handle(ImageAt(kImages + 5));
  EXPECT_EQ(robot.reports.back().state, TrackingState::kInitializing);
}

TEST_F(TrackingCommands, APauseIsASilentCamera) {
  const std::size_t before = robot.reports.size();
  robot.loop.Pause(true);
  robot.Drive(kImages, kImages + 10);
  EXPECT_EQ(robot.reports.size(), before);
  robot.loop.Pause(false);
  robot.Drive(kImages + 10, kImages + 15);
  EXPECT_EQ(robot.reports.size(), before + 5);
  EXPECT_TRUE(robot.Tracks());
}

TEST_F(TrackingCommands, ModesMapsAndRestartsManyTimesLeadToTheSame) {
  const SavedMap saved = Save(robot);
  int image = kImages;
  for (int round = 0; round < 10; ++round) {
    ASSERT_TRUE(robot.loop.LoadMap(saved).ok());
    ASSERT_TRUE(robot.loop.SetMode(RunMode::kLocalization).ok());
    ASSERT_TRUE(robot.loop.SetMode(RunMode::kMapping).ok());
    robot.loop.Restart();
    ASSERT_TRUE(robot.loop.StartAt(StartAt(0.0)).ok());
    robot.Drive(image, image + 2);
    image += 2;
    ASSERT_NE(robot.loop.map(), nullptr);
    EXPECT_LE(robot.loop.map()->keyframes.size(), saved.map.keyframes.size() + 2);
  }
  EXPECT_EQ(robot.restarts, 20);
}

}  // namespace
}  // namespace planar_vslam::ros_face
