// A pose that the laser measured takes part in the tracker's.
#include <gtest/gtest.h>

#include "planar_vslam/frontend/tracker.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

class TrackerFixTest : public ::testing::Test {
 protected:
  TrackerFixTest()
      : world_(test::MakeSyntheticWorld({})),
        tracker_({world_.camera, world_.odometry_noise, {}, TrackerOptions{}, 1.0}) {
    tracker_.Start(world_.map, KeyframeId{0});
  }
  // A frame at `at`, without features yet; wheels that claim `slip` on top of the true motion.
  TrackInput Input(double at, const Rigid2& slip) {
    TrackInput input;
    input.stamp = Timestamp::FromSeconds(0.1 * static_cast<double>(++frame_));
    input.T_base_camera = world_.T_base_camera;
    input.odometry = test::ExactOdometry(world_, test::SyntheticPose(at_), test::SyntheticPose(at) * Embed3(slip));
    input.slot = KeyframeSlot::kNone;
    at_ = at;
    return input;
  }
  FrameFeaturesPtr SeenFrom(const Rigid3& T_map_base) const {
    return test::Observe(world_, T_map_base * world_.T_base_camera, 0.5, 3).features;
  }
  static PlanarFix FixAt(const Rigid3& T_map_base) {
    constexpr double kSigma = 0.01;  // m, rad
    return {ProjectToPlane(T_map_base), kSigma * kSigma * Eigen::Matrix3d::Identity(), true};
  }

  test::SyntheticWorld world_;
  Tracker tracker_;
  double at_ = 0.0;
  int frame_ = 0;
};

double Distance(const Rigid3& a, const Rigid3& b) { return (a.translation - b.translation).norm(); }

TEST_F(TrackerFixTest, ABlindFrameIsWhereTheFixSays) {
  TrackInput input = Input(0.1, Rigid2(0.2, -0.1, 0.1));
  input.features = std::make_shared<const FrameFeatures>();
  input.fix = FixAt(test::SyntheticPose(0.1));
  const TrackResult result = tracker_.Track(input, world_.map);
  EXPECT_EQ(result.status, TrackingState::kOdometry);
  EXPECT_LT(Distance(result.T_map_base, test::SyntheticPose(0.1)), 0.02);
  EXPECT_LT(result.covariance(0, 0), 0.02 * 0.02);
  EXPECT_GT(result.covariance(0, 0), 0.0);
}

TEST_F(TrackerFixTest, AnIncompleteFixLeavesTheRestToTheWheels) {
  TrackInput input = Input(0.1, Rigid2());
  input.features = std::make_shared<const FrameFeatures>();
  input.fix = FixAt(test::SyntheticPose(0.1) * Embed3(Rigid2(0.5, 0.0, 0.0)));
  input.fix->covariance(0, 0) = 1e4;
  input.fix->complete = false;
  const TrackResult result = tracker_.Track(input, world_.map);
  EXPECT_LT(Distance(result.T_map_base, test::SyntheticPose(0.1)), 0.03);
}

TEST_F(TrackerFixTest, WhatWasMovedDoesNotOverruleTheFix) {
  const Rigid3 truth = test::SyntheticPose(0.1), elsewhere = truth * Embed3(Rigid2(0.25, 0.0, 0.0));
  TrackInput input = Input(0.1, Rigid2());
  input.features = SeenFrom(elsewhere);
  Tracker without = tracker_;
  EXPECT_LT(Distance(without.Track(input, world_.map).T_map_base, elsewhere), 0.03)
      << "the camera overrules the wheels";
  input.fix = FixAt(truth);
  const TrackResult result = tracker_.Track(input, world_.map);
  EXPECT_LT(Distance(result.T_map_base, truth), 0.03);
  EXPECT_FALSE(result.odometry_rejected);
}

TEST_F(TrackerFixTest, OnePartOfTheImageDoesNotOverruleTheWheels) {
  const Rigid3 truth = test::SyntheticPose(0.1), elsewhere = truth * Embed3(Rigid2(0.25, 0.0, 0.0));
  TrackInput input = Input(0.1, Rigid2());
  FrameFeatures one_thing = *SeenFrom(elsewhere);
  const FrameFeatures all = one_thing;
  one_thing.keypoints.clear();
  one_thing.descriptors.clear();
  for (std::size_t i = 0; i < all.keypoints.size(); ++i) {
    const Eigen::Vector2f& pixel = all.keypoints[i].pixel;
    if (pixel.x() > 0.5F * static_cast<float>(world_.camera.width)) continue;
    if (pixel.y() > 0.6F * static_cast<float>(world_.camera.height)) continue;
    one_thing.keypoints.push_back(all.keypoints[i]);
    one_thing.descriptors.push_back(all.descriptors[i]);
  }
  one_thing.grid = ImageGrid(one_thing.keypoints);
  input.features = std::make_shared<const FrameFeatures>(one_thing);
  const TrackResult result = tracker_.Track(input, world_.map);
  EXPECT_LT(Distance(result.T_map_base, truth), 0.03);
}

}  // namespace
}  // namespace planar_vslam
