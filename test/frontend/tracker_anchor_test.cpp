// The pose that is told has odometry since the last keyframe for its prior: what landmarks are off by counts once.
#include <gtest/gtest.h>

#include <cmath>

#include "planar_vslam/frontend/tracker.h"
#include "planar_vslam/map/map_edit.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

constexpr double kPixelSigma = 5.0;  // px: one view tells the pose less well than odometry from a keyframe nearby

class TrackerAnchorTest : public ::testing::Test {
 protected:
  TrackerAnchorTest() : world_(test::MakeSyntheticWorld({})), map_(world_.map), tracker_(MakeTracker(kPixelSigma)) {
    tracker_.Start(map_, KeyframeId{0});
  }
  Tracker MakeTracker(double pixel_sigma) const {
    return Tracker({world_.camera, world_.odometry_noise, {}, TrackerOptions{}, pixel_sigma});
  }
  // The frame `x` metres down the path, after odometry that claims `more` beside the way from the frame before.
  TrackResult Track(double x, const Rigid2& more = Rigid2(), KeyframeSlot slot = KeyframeSlot::kTaken) {
    TrackInput input;
    input.stamp = Timestamp::FromSeconds(0.1 * static_cast<double>(++frame_));
    input.slot = slot;
    input.T_base_camera = world_.T_base_camera;
    const Rigid3 T_map_camera = test::SyntheticPose(x) * world_.T_base_camera;
    input.features = test::Observe(world_, T_map_camera, 0.5, static_cast<std::uint32_t>(frame_)).features;
    input.odometry = test::ExactOdometry(world_, test::SyntheticPose(x_), test::SyntheticPose(x) * Embed3(more));
    x_ = x;
    return tracker_.Track(input, map_);
  }
  // All landmarks are mapped `off` metres from where they are, along the path: so are poses by the view alone.
  void MoveLandmarks(double off) {
    MapEdit edit;
    for (const auto& [id, landmark] : map_.landmarks) {
      edit.emplace_back(SetLandmarkPosition{id, landmark.p_map + Eigen::Vector3d(off, 0.0, 0.0)});
    }
    map_ = Apply(std::move(map_), edit);
  }
  double OffAlongPath(const TrackResult& result) const {
    return (test::SyntheticPose(x_).Inverse() * result.T_map_base).translation.x();
  }

  test::SyntheticWorld world_;
  Map map_;
  Tracker tracker_;
  double x_ = 0.0;
  int frame_ = 0;
};

constexpr double kLandmarksOff = 0.006;  // m, some standard deviations of odometry over a keyframe's way

TEST_F(TrackerAnchorTest, LookingLongerAtTheSameLandmarksMakesThemNoMoreCertain) {
  MoveLandmarks(kLandmarksOff);
  const TrackResult first = Track(0.0);
  TrackResult result;
  for (int i = 0; i < 40; ++i) result = Track(0.0);
  ASSERT_EQ(result.status, TrackingState::kTracking);
  EXPECT_LT(std::abs(OffAlongPath(first)), 0.25 * kLandmarksOff);
  EXPECT_LT(std::abs(OffAlongPath(result)), 0.25 * kLandmarksOff);
}

TEST_F(TrackerAnchorTest, InAMapThatDoesNotGrowEachFrameIsThePriorOfTheNext) {
  MoveLandmarks(kLandmarksOff);
  tracker_.StartAt(map_, test::SyntheticPose(0.0), 1e-6 * Matrix6d::Identity());
  TrackResult result;
  for (int i = 0; i < 40; ++i) result = Track(0.0, Rigid2(), KeyframeSlot::kNone);
  EXPECT_GT(OffAlongPath(result), 0.4 * kLandmarksOff) << "such maps are adjusted as a whole";
}

TEST_F(TrackerAnchorTest, AWayThatTheWheelsCountTooLongIsNoticedOverManyImages) {
  constexpr double kTooLong = 0.004;  // m an image: no single one contradicts it
  tracker_ = MakeTracker(1.0);
  tracker_.Start(map_, KeyframeId{0});
  TrackResult result;
  for (int i = 1; i <= 30; ++i) {
    result = Track(0.02 * i, Rigid2(kTooLong, 0.0, 0.0));
    ASSERT_EQ(result.status, TrackingState::kTracking);
    EXPECT_FALSE(result.odometry_rejected);
  }
  EXPECT_LT(std::abs(OffAlongPath(result)), 0.02) << "odometry alone: 0.12";
}

TEST_F(TrackerAnchorTest, AKeyframeThatIsMappedLateIsWhereOdometryCountsFrom) {
  double x = 0.0;
  while (!Track(x, Rigid2(), KeyframeSlot::kFree).wants_keyframe) x += 0.25;
  ASSERT_LT(x, 1.5);
  const KeyframeId wanted{static_cast<std::uint32_t>(std::lround(x / 0.25))};
  for (int i = 1; i <= 3; ++i) Track(x + 0.05 * i);
  tracker_.OnKeyframe(map_, wanted, world_.true_poses[wanted.value].Inverse() * *tracker_.LastPose(map_));
  MoveLandmarks(kLandmarksOff);
  TrackResult result;
  for (int i = 0; i < 20; ++i) result = Track(x_);
  EXPECT_EQ(result.reference, wanted);
  EXPECT_LT(std::abs(OffAlongPath(result)), 0.35 * kLandmarksOff);
}

TEST_F(TrackerAnchorTest, BlindFramesGoOnFromThePoseThatWasTold) {
  MoveLandmarks(kLandmarksOff);
  TrackResult seen;
  for (int i = 0; i < 20; ++i) seen = Track(0.0);
  TrackInput blind;
  blind.stamp = Timestamp::FromSeconds(10.0);
  blind.T_base_camera = world_.T_base_camera;
  blind.features = std::make_shared<const FrameFeatures>();
  blind.odometry = test::ExactOdometry(world_, test::SyntheticPose(0.0), test::SyntheticPose(0.3));
  const TrackResult result = tracker_.Track(blind, map_);
  EXPECT_EQ(result.status, TrackingState::kOdometry);
  const Rigid3 step = Embed3(ProjectToPlane(test::SyntheticPose(0.0).Inverse() * test::SyntheticPose(0.3)));
  EXPECT_LT(LogSe3((seen.T_map_base * step).Inverse() * result.T_map_base).norm(), 1e-9);
}

}  // namespace
}  // namespace planar_vslam
