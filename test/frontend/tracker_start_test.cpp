// A tracker that is told where it is in a known map, rightly or not.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "planar_vslam/frontend/tracker.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

constexpr double kStart = 0.8;  // m down the path, where the robot stands
constexpr double kStep = 0.05;  // m between frames

Matrix6d Covariance(double position_sigma, double angle_sigma) {  // of x, y and yaw, as a map on a screen gives it
  Vector6d variances = Vector6d::Zero();
  variances[0] = variances[1] = position_sigma * position_sigma;
  variances[5] = angle_sigma * angle_sigma;
  return variances.asDiagonal();
}

class TrackerStartTest : public ::testing::Test {
 protected:
  // The next frame, `step` metres down the path.
  TrackResult Drive(bool with_odometry, bool recognizable = true, double step = kStep) {
    const Rigid3 T_map_before = test::SyntheticPose(x_);
    x_ += step;
    ++frame_;
    TrackInput input;
    input.stamp = Timestamp::FromSeconds(0.1 * frame_);
    input.T_base_camera = world_.T_base_camera;
    FrameFeatures features =
        *test::Observe(world_, Truth() * world_.T_base_camera, 0.5, static_cast<std::uint32_t>(frame_)).features;
    std::mt19937 generator(static_cast<std::uint32_t>(frame_));
    if (!recognizable) std::shuffle(features.descriptors.begin(), features.descriptors.end(), generator);
    input.features = std::make_shared<const FrameFeatures>(std::move(features));
    if (with_odometry) input.odometry = test::ExactOdometry(world_, T_map_before, Truth());
    return tracker_.Track(input, world_.map);
  }
  Rigid3 Truth() const { return test::SyntheticPose(x_); }
  void ExpectAtTheTruth(const TrackResult& result) const {
    const Vector6d error = LogSe3(Truth().Inverse() * result.T_map_base);
    EXPECT_LT(error.head<3>().norm(), 0.02);
    EXPECT_LT(error.tail<3>().norm(), 0.005);
  }
  void ExpectRelativeToItsReference(const TrackResult& result) const {
    const Rigid3 T_map_base = world_.map.keyframes.At(result.reference).T_map_base * result.T_ref_base;
    EXPECT_LT(LogSe3(T_map_base.Inverse() * result.T_map_base).norm(), 1e-9);
  }

  test::SyntheticWorld world_ = test::MakeSyntheticWorld({});
  Tracker tracker_{{world_.camera, world_.odometry_noise, PlanarPriorOptions{}, TrackerOptions{}}};
  double x_ = kStart;  // m, where the robot is
  int frame_ = 0;
};

TEST_F(TrackerStartTest, APoseAFewCentimetresOffIsConfirmedByTheFirstFrame) {
  tracker_.StartAt(world_.map, test::SyntheticPose(kStart) * Embed3(Rigid2(0.03, -0.02, DegreesToRadians(1.0))),
                   Covariance(0.05, DegreesToRadians(1.5)));
  EXPECT_TRUE(tracker_.localized());
  const TrackResult result = Drive(true);
  ASSERT_EQ(result.status, TrackingState::kRelocalized);
  EXPECT_FALSE(result.odometry_rejected);
  EXPECT_FALSE(result.jumped);
  ExpectAtTheTruth(result);
  EXPECT_EQ(Drive(true).status, TrackingState::kTracking);
}

TEST_F(TrackerStartTest, APoseThatIsRoughlyRightIsCorrectedWithinSomeFrames) {
  const Rigid3 given = test::SyntheticPose(kStart) * Embed3(Rigid2(0.25, -0.17, DegreesToRadians(10.0)));
  tracker_.StartAt(world_.map, given, Covariance(0.25, DegreesToRadians(10.0)));
  TrackResult result = Drive(true);
  EXPECT_EQ(result.status, TrackingState::kOdometry);
  EXPECT_FALSE(result.wants_keyframe);
  EXPECT_GT(result.covariance(0, 0), 0.2 * 0.2);
  ExpectRelativeToItsReference(result);
  constexpr int kFrames = 5;
  for (int i = 1; i < kFrames && result.status == TrackingState::kOdometry; ++i) result = Drive(true);
  ASSERT_EQ(result.status, TrackingState::kRelocalized);
  EXPECT_FALSE(result.odometry_rejected) << "the wheels were right";
  EXPECT_EQ(result.slip.norm(), 0.0);
  ExpectAtTheTruth(result);
  ExpectRelativeToItsReference(result);
  EXPECT_EQ(Drive(true).status, TrackingState::kTracking);
}

TEST_F(TrackerStartTest, APoseThatIsWrongIsGivenUp) {
  const Rigid3 given = Embed3(Rigid2(15.0, 10.0, 2.0));  // nothing of the map is near
  tracker_.StartAt(world_.map, given, Covariance(0.25, DegreesToRadians(10.0)));
  constexpr int kFrames = 40;
  TrackResult result = Drive(true, true, 0.0);
  for (int i = 1; i < kFrames && result.status == TrackingState::kOdometry; ++i) {
    ASSERT_FALSE(result.wants_keyframe) << i;
    result = Drive(true, true, 0.0);
  }
  ASSERT_EQ(result.status, TrackingState::kRelocalized);
  EXPECT_TRUE(result.jumped);
  EXPECT_FALSE(result.odometry_rejected);
  ExpectAtTheTruth(result);
}

TEST_F(TrackerStartTest, MakesNoKeyframeBeforeAViewConfirmsThePose) {
  tracker_.StartAt(world_.map, test::SyntheticPose(kStart), Covariance(0.25, DegreesToRadians(10.0)));
  for (int i = 0; i < 15; ++i) {  // 0.75 m, which on odometry is worth keyframes
    const TrackResult result = Drive(true, false);
    ASSERT_EQ(result.status, TrackingState::kOdometry);
    EXPECT_FALSE(result.wants_keyframe) << i;
  }
  bool wanted = false;
  for (int i = 0; i < 5; ++i) wanted = Drive(true).wants_keyframe || wanted;
  EXPECT_TRUE(wanted);
}

TEST_F(TrackerStartTest, WithoutOdometryIsLostAtTheGivenPoseUntilAViewIsRecognized) {
  const Rigid3 given = test::SyntheticPose(kStart) * Embed3(Rigid2(0.3, 0.0, 0.1));
  tracker_.StartAt(world_.map, given, Covariance(0.25, DegreesToRadians(10.0)));
  const TrackResult lost = Drive(false, false);
  EXPECT_EQ(lost.status, TrackingState::kLost);
  EXPECT_FALSE(lost.wants_keyframe);
  EXPECT_LT(LogSe3(given.Inverse() * lost.T_map_base).norm(), 1e-9);
  ExpectRelativeToItsReference(lost);
  EXPECT_TRUE(tracker_.localized());
  const TrackResult found = Drive(false);
  ASSERT_EQ(found.status, TrackingState::kRelocalized);
  ExpectAtTheTruth(found);
}

TEST_F(TrackerStartTest, ForgetsWhatItKnewBefore) {
  tracker_.Start(world_.map, KeyframeId{0});
  tracker_.StartAt(world_.map, test::SyntheticPose(kStart), Covariance(0.02, DegreesToRadians(0.5)));
  const TrackResult result = Drive(true);
  ASSERT_EQ(result.status, TrackingState::kRelocalized);
  ExpectAtTheTruth(result);
}

}  // namespace
}  // namespace planar_vslam
