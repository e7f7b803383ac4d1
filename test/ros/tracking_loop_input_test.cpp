// The tracking loop, message by message: what it waits for, what it counts instead of using it, when it starts over.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tracking_loop.h"
#include "tracking_loop_testing.h"

namespace planar_vslam::ros_face {
namespace {

constexpr int kImages = 40;  // of a drive that makes a map

class TrackingLoopInput : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { ros::Time::init(); }
};

TEST_F(TrackingLoopInput, AnImageWaitsForWhatItNeedsAndSaysSo) {
  Robot robot;
  robot.Handle(ImageAt(0));
  EXPECT_EQ(robot.loop.waiting_for(), "camera_info");
  robot.Handle(sensor_msgs::CameraInfoConstPtr(boost::make_shared<sensor_msgs::CameraInfo>()));
  EXPECT_EQ(robot.loop.waiting_for(), "camera_info") << "a driver that has not read its calibration";
  robot.Handle(CameraInfo());
  EXPECT_EQ(robot.loop.waiting_for(), "tf " + BaseFrame() + " -> camera");
  robot.Handle(CameraTransform());
  EXPECT_EQ(robot.loop.waiting_for(), "odometry");
  EXPECT_TRUE(robot.reports.empty());
  robot.Handle(OdometryAt(0));
  EXPECT_EQ(robot.loop.waiting_for(), "");
  ASSERT_EQ(robot.reports.size(), 1U);
  EXPECT_EQ(robot.reports.front().stamp, WallDrive::StampOf(0));
  robot.Drive(1, kImages);
  EXPECT_TRUE(robot.Tracks());
  EXPECT_TRUE(robot.loop.unused().empty());
}

TEST_F(TrackingLoopInput, AnImageWhoseTransformNeverComesIsDroppedAfterTwoSeconds) {
  Robot robot;
  robot.Handle(CameraInfo());
  robot.Handle(ImageAt(0));
  robot.Handle(ImageAt(39));
  EXPECT_EQ(robot.Unused("image waited"), 0) << "1.95 s";
  robot.Handle(ImageAt(41));
  EXPECT_EQ(robot.Unused("image waited"), 1) << "2.05 s";
  EXPECT_EQ(robot.loop.waiting_for(), "tf " + BaseFrame() + " -> camera");
  robot.Handle(CameraTransform());
  robot.Handle(OdometryAt(38));
  robot.Handle(OdometryAt(41));
  EXPECT_EQ(robot.reports.size(), 2U) << "the other two images";
}

TEST_F(TrackingLoopInput, StampsThatAreZeroOrDoNotIncreaseAreCounted) {
  Robot robot;
  robot.Begin();
  robot.Handle(Odometry(ros::Time(), 0));
  robot.Handle(Image(ros::Time(), Wall().View(0)));
  robot.Handle(sensor_msgs::LaserScanConstPtr(boost::make_shared<sensor_msgs::LaserScan>()));
  EXPECT_EQ(robot.Unused("odometry stamp zero"), 1);
  EXPECT_EQ(robot.Unused("image stamp zero"), 1);
  EXPECT_EQ(robot.Unused("scan stamp zero"), 1);
  robot.Drive(0, 5);
  robot.Handle(OdometryAt(3));
  robot.Handle(ImageAt(4));
  robot.Handle(ImageAt(1));
  EXPECT_EQ(robot.Unused("odometry stamp not increasing"), 1);
  EXPECT_EQ(robot.Unused("image stamp not increasing"), 2);
  EXPECT_EQ(robot.reports.size(), 5U);
  EXPECT_EQ(robot.restarts, 0);
  robot.Drive(5, kImages);
  EXPECT_TRUE(robot.Tracks());
}

TEST_F(TrackingLoopInput, TimeThatJumpsBackStartsOver) {
  Robot robot;
  robot.Begin();
  robot.Drive(0, kImages);
  ASSERT_TRUE(robot.Tracks());
  robot.Handle(OdometryAt(0));
  EXPECT_EQ(robot.restarts, 1);
  ASSERT_NE(robot.loop.estimator(), nullptr);
  EXPECT_EQ(robot.loop.map(), nullptr);
  robot.reports.clear();
  robot.Handle(ImageAt(0));
  robot.Drive(1, kImages);
  EXPECT_EQ(robot.restarts, 1);
  EXPECT_EQ(robot.reports.size(), static_cast<std::size_t>(kImages));
  EXPECT_TRUE(robot.Tracks());
  EXPECT_TRUE(robot.loop.unused().empty());
}

TEST_F(TrackingLoopInput, AnImageThatJumpsBackStartsOverAsWell) {
  Robot robot;
  robot.Begin();
  robot.Drive(0, kImages);
  robot.Handle(ImageAt(0));
  EXPECT_EQ(robot.restarts, 1);
  EXPECT_EQ(robot.loop.map(), nullptr);
  robot.Drive(1, kImages);
  EXPECT_EQ(robot.restarts, 1);
  EXPECT_TRUE(robot.Tracks());
}

TEST_F(TrackingLoopInput, RestartDropsTheMapAndTheDriveGoesOn) {
  Robot robot;
  robot.Begin();
  robot.Drive(0, kImages);
  ASSERT_TRUE(robot.loop.Snapshot().has_value());
  robot.loop.Restart();
  EXPECT_EQ(robot.restarts, 1);
  EXPECT_EQ(robot.loop.map(), nullptr);
  EXPECT_FALSE(robot.loop.Snapshot().has_value());
  robot.Drive(kImages, 2 * kImages);
  EXPECT_TRUE(robot.Tracks());
  ASSERT_NE(robot.loop.map(), nullptr);
  EXPECT_GE((*robot.loop.map()->keyframes.begin()).second.stamp, WallDrive::StampOf(kImages));
}

// Where frames at the place of image `position` are in the odometry frame, for the base and other children of it.
TfInput OdometryTransforms(int position, const std::vector<std::string>& children) {
  const auto message = boost::make_shared<tf2_msgs::TFMessage>();
  const Rigid3 T_odom_base = Embed3(WallDrive::PoseOf(position));
  const Rigid3 T_odom_other(Eigen::Quaterniond::Identity(), Eigen::Vector3d(7.0, 7.0, 0.0));
  for (const std::string& child : children) {
    std_msgs::Header header;
    header.stamp = StampOf(position);
    header.frame_id = "odom";
    message->transforms.push_back(ToTransform(header, child, child == BaseFrame() ? T_odom_base : T_odom_other));
  }
  return {message, false};
}

void DriveByTf(Robot* robot, int from, int to, const std::vector<std::string>& children) {
  for (int i = from; i < to; ++i) {
    robot->Handle(OdometryTransforms(i, children));
    robot->Handle(ImageAt(i));
  }
}

// The odometry is faultless: its frame stays where the base of the map's first keyframe says.
void ExpectPosesByOdometry(const Robot& robot) {
  ASSERT_TRUE(robot.Tracks());
  EXPECT_EQ(robot.reports.size(), static_cast<std::size_t>(kImages));
  const FrameReport& last = robot.reports.back();
  ASSERT_TRUE(last.T_map_base.has_value() && last.T_map_odom.has_value());
  const auto first = std::find_if(robot.reports.begin(), robot.reports.end(), [&](const FrameReport& report) {
    return report.stamp == (*robot.loop.map()->keyframes.begin()).second.stamp;
  });
  ASSERT_NE(first, robot.reports.end());
  const Rigid2 T_odom_map = WallDrive::PoseOf(static_cast<int>(first - robot.reports.begin()));
  EXPECT_LT(LogSe2(*last.T_map_odom * T_odom_map).norm(), 0.02);
}

TEST_F(TrackingLoopInput, OdometryOfTfGivesPosesAndTheOdometryFrame) {
  Robot robot(Settings(OdometrySource::kTf));
  robot.Begin();
  robot.Handle(OdometryAt(90));  // of the topic: not used
  DriveByTf(&robot, 0, kImages, {BaseFrame()});
  ExpectPosesByOdometry(robot);
  EXPECT_EQ(robot.restarts, 0);
  EXPECT_TRUE(robot.loop.unused().empty());
}

TEST_F(TrackingLoopInput, AnotherChildOfTheOdometryFrameDoesNotHideTheBase) {
  for (const std::vector<std::string>& children :
       {std::vector{std::string("other"), BaseFrame()}, {BaseFrame(), "other"}}) {
    Robot robot(Settings(OdometrySource::kTf));
    robot.Begin();
    DriveByTf(&robot, 0, kImages, children);
    ExpectPosesByOdometry(robot);
  }
}

TEST_F(TrackingLoopInput, TimeOfTfThatJumpsBackStartsOver) {
  Robot robot(Settings(OdometrySource::kTf));
  robot.Begin();
  DriveByTf(&robot, 0, kImages, {"other", BaseFrame()});
  robot.reports.clear();
  DriveByTf(&robot, 0, kImages, {"other", BaseFrame()});
  EXPECT_EQ(robot.restarts, 1);
  ExpectPosesByOdometry(robot);
}

// Static transforms are sent again whenever a publisher of them starts, with stamps of any age.
TEST_F(TrackingLoopInput, AStaticChildOfTheOdometryFrameIsNoOdometry) {
  Robot robot(Settings(OdometrySource::kTf));
  robot.Begin();
  DriveByTf(&robot, 0, kImages, {BaseFrame()});
  TfInput dock = OdometryTransforms(0, {"dock"});
  dock.is_static = true;
  robot.Handle(dock);
  EXPECT_EQ(robot.restarts, 0);
  EXPECT_TRUE(robot.Tracks());
  EXPECT_TRUE(robot.loop.unused().empty());
}

TEST_F(TrackingLoopInput, AMapThatDoesNotFitIsRefusedAndNothingIsTracked) {
  Robot mapper;
  mapper.Begin();
  mapper.Drive(0, kImages);
  const std::optional<EstimatorSnapshot> snapshot = mapper.loop.Snapshot();
  ASSERT_TRUE(snapshot.has_value());
  const SavedMap fits{*snapshot->map, snapshot->camera};
  SavedMap other_scales = fits, other_camera = fits;
  other_scales.map.octave_scales.pop_back();
  other_camera.camera.fx += 20.0;
  for (const SavedMap& saved : {other_scales, other_camera}) {
    NodeSettings settings = Settings();
    settings.saved_map = std::make_shared<const SavedMap>(saved);
    Robot robot(settings);
    robot.Handle(ImageAt(0));
    robot.Begin();
    robot.Drive(1, kImages);
    ASSERT_EQ(robot.refusals.size(), 1U);
    EXPECT_FALSE(robot.refusals.front().empty());
    EXPECT_EQ(robot.refusals.front().find('\n'), std::string::npos);
    EXPECT_TRUE(robot.reports.empty());
    EXPECT_EQ(robot.loop.map(), nullptr);
    EXPECT_EQ(robot.loop.waiting_for(), "") << "it has come";
  }
}

TEST_F(TrackingLoopInput, ImagesOfAnotherSizeAreCounted) {
  Robot robot;
  robot.Begin();
  robot.Drive(0, 2);
  std::vector<std::uint8_t> cropped = Wall().View(2);
  cropped.resize(cropped.size() / 2);
  robot.Handle(OdometryAt(2));
  robot.Handle(Image(StampOf(2), cropped));
  EXPECT_EQ(robot.Unused("image of another size"), 1);
  EXPECT_EQ(robot.reports.size(), 2U);
  EXPECT_EQ(robot.loop.waiting_for(), "");
  robot.Drive(3, kImages);
  EXPECT_TRUE(robot.Tracks());
}

// The lower half of the view is a wall half as far away: one wall alone does not tell how the camera moved.
std::vector<std::uint8_t> TwoWalls(int position) {
  std::vector<std::uint8_t> view = Wall().View(position), near = Wall().View(2 * position);
  const auto half = static_cast<std::ptrdiff_t>(view.size() / 2);
  std::copy(near.begin() + half, near.end(), view.begin() + half);
  return view;
}

TEST_F(TrackingLoopInput, WithoutOdometryFramesAreReportedAtOnceAndTheMapStartsVisually) {
  Robot robot(Settings(OdometrySource::kNone));
  robot.Begin();
  for (int i = 0; i < 60; ++i) {
    robot.Handle(Image(StampOf(i), TwoWalls(i)));
    ASSERT_EQ(robot.reports.size(), static_cast<std::size_t>(i) + 1U);
  }
  ASSERT_NE(robot.loop.map(), nullptr) << robot.reports.back().waiting_for;
  EXPECT_FALSE(robot.loop.map()->metric);
  EXPECT_EQ(robot.reports.back().state, TrackingState::kTracking);
  EXPECT_FALSE(robot.reports.back().metric);
  EXPECT_FALSE(robot.reports.back().T_map_odom.has_value());
}

TEST_F(TrackingLoopInput, AHandheldCameraNeedsNoTransform) {
  NodeSettings settings = Settings(OdometrySource::kNone);
  settings.pipeline.topics.base_frame.clear();
  Robot robot(settings);
  robot.Handle(CameraInfo());
  robot.Handle(ImageAt(0));
  EXPECT_EQ(robot.reports.size(), 1U);
}

TEST_F(TrackingLoopInput, AScanWithoutTransformHoldsUpNoImage) {
  Robot robot;
  robot.Begin();
  for (int i = 0; i < 60; ++i) {
    const auto scan = boost::make_shared<sensor_msgs::LaserScan>();
    scan->header.stamp = StampOf(i);
    scan->header.frame_id = "laser";
    robot.Handle(sensor_msgs::LaserScanConstPtr(scan));
    robot.Drive(i, i + 1);
    ASSERT_EQ(robot.reports.size(), static_cast<std::size_t>(i) + 1U);
  }
  EXPECT_TRUE(robot.Tracks());
  EXPECT_EQ(robot.loop.waiting_for(), "");
  EXPECT_GT(robot.Unused("scan waited"), 0);
}

TEST_F(TrackingLoopInput, MessagesThatMakeNoSenseAreCountedByWhatIsWrong) {
  Robot robot;
  robot.Begin();
  robot.Drive(0, 2);
  nav_msgs::Odometry odometry = *std::get<nav_msgs::OdometryConstPtr>(OdometryAt(2));
  odometry.pose.pose.orientation.w = 0.3;
  robot.Handle(boost::make_shared<const nav_msgs::Odometry>(odometry));
  sensor_msgs::LaserScan scan;
  scan.header.stamp = StampOf(2);
  scan.header.frame_id = BaseFrame();
  scan.angle_min = -90.0F;
  scan.ranges = {1.0F, 2.0F};
  robot.Handle(boost::make_shared<const sensor_msgs::LaserScan>(scan));
  robot.Drive(3, 5);
  EXPECT_EQ(robot.Unused("odometry orientation is no unit quaternion"), 1);
  EXPECT_EQ(robot.Unused("scan angle"), 1);
}

}  // namespace
}  // namespace planar_vslam::ros_face
