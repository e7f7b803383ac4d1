// Landmarks that only the two keyframes have seen which placed them do not overrule the wheels.
#include <gtest/gtest.h>

#include "planar_vslam/frontend/tracker.h"
#include "planar_vslam/map/map_edit.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

// The map with at most so many observations of each landmark.
Map SeenBy(const Map& map, std::size_t keyframes) {
  MapEdit edit;
  for (const auto& [id, landmark] : map.landmarks) {
    for (std::size_t i = keyframes; i < landmark.observations.size(); ++i) {
      edit.emplace_back(EraseObservation{id, landmark.observations[i].keyframe});
    }
  }
  return Apply(map, edit);
}

class TrackerDoubtTest : public ::testing::Test {
 protected:
  // The third of three frames, after wheels that claim `slip` on top of the true motion.
  TrackResult TrackAfterSlip(std::size_t keyframes, const Rigid2& slip) {
    const Map map = SeenBy(world_.map, keyframes);
    Tracker tracker({world_.camera, world_.odometry_noise, {}, TrackerOptions{}, 1.0});
    tracker.Start(map, KeyframeId{0});
    return TrackAfterSlip(map, slip, &tracker);
  }
  TrackResult TrackAfterSlip(const Map& map, const Rigid2& slip, Tracker* tracker) {
    TrackResult result;
    double before = 0.0;
    for (const double at : {0.3, 0.35, 0.4}) {
      TrackInput input;
      input.stamp = Timestamp::FromSeconds(at);
      input.T_base_camera = world_.T_base_camera;
      input.features = test::Observe(world_, test::SyntheticPose(at) * world_.T_base_camera, 0.5, 3).features;
      const Rigid3 claimed = test::SyntheticPose(at) * (at == 0.4 ? Embed3(slip) : Rigid3());
      input.odometry = test::ExactOdometry(world_, test::SyntheticPose(before), claimed);
      before = at;
      result = tracker->Track(input, map);
    }
    return result;
  }

  test::SyntheticWorld world_ = test::MakeSyntheticWorld({});
};

double OffTruth(const TrackResult& result) {
  return (result.T_map_base.translation - test::SyntheticPose(0.4).translation).norm();
}

TEST_F(TrackerDoubtTest, TwoKeyframesDoNotOverruleTheWheels) {
  const TrackResult result = TrackAfterSlip(2, Rigid2(0.2, 0.0, 0.0));
  EXPECT_EQ(result.status, TrackingState::kOdometry);
  EXPECT_FALSE(result.odometry_rejected);
  EXPECT_NEAR(OffTruth(result), 0.2, 0.01);
}

TEST_F(TrackerDoubtTest, ThreeDo) {
  const TrackResult result = TrackAfterSlip(3, Rigid2(0.2, 0.0, 0.0));
  EXPECT_EQ(result.status, TrackingState::kTracking);
  EXPECT_TRUE(result.odometry_rejected);
  EXPECT_LT(OffTruth(result), 0.02);
}

TEST_F(TrackerDoubtTest, NotThreeThatWerePlacedWithoutTheWheels) {
  Tracker tracker({world_.camera, world_.odometry_noise, {}, TrackerOptions{}, 1.0});
  Map map = world_.map;
  for (const KeyframeId id : world_.map.keyframes.Ids()) {
    if (id.value > 1) map = Apply(std::move(map), {EraseKeyframe{id}});
  }
  tracker.Start(map, KeyframeId{0});
  const TrackResult result = TrackAfterSlip(world_.map, Rigid2(0.2, 0.0, 0.0), &tracker);
  EXPECT_EQ(result.status, TrackingState::kOdometry) << "the other six came without a frame that agreed";
}

TEST(ScaleAgreementTest, ReachesKeyframesThatWereThereBeforeAWayOnWhichAllAgreed) {
  ScaleAgreement agreement(KeyframeId{3});
  agreement.Disagree(KeyframeId{4});
  for (int i = 0; i < 5; ++i) agreement.Add(0.02, KeyframeId{5});
  EXPECT_EQ(agreement.until(), KeyframeId{3}) << "0.1 m";
  for (int i = 0; i < 5; ++i) agreement.Add(0.02, KeyframeId{6});
  EXPECT_EQ(agreement.until(), KeyframeId{4}) << "0.2 m, in which 5 and 6 came";
}

TEST(ScaleAgreementTest, AWayWithADisputeCountsFromThere) {
  ScaleAgreement agreement(KeyframeId{3});
  for (int i = 0; i < 5; ++i) {
    agreement.Add(0.1, KeyframeId{5});
    agreement.Disagree(KeyframeId{5});
  }
  EXPECT_EQ(agreement.until(), KeyframeId{3});
}

TEST_F(TrackerDoubtTest, WheelsThatStandOrTurnWhereTheViewMovesAreOverruledByTwo) {
  for (const Rigid2& slip : {Rigid2(-0.05, 0.0, 0.0), Rigid2(0.2, 0.0, 0.2)}) {
    const TrackResult result = TrackAfterSlip(2, slip);
    EXPECT_EQ(result.status, TrackingState::kTracking);
    EXPECT_TRUE(result.odometry_rejected);
    EXPECT_LT(OffTruth(result), 0.02);
  }
}

TEST_F(TrackerDoubtTest, WheelsThatAgreeNeedNoMoreThanTwo) {
  const TrackResult result = TrackAfterSlip(2, Rigid2());
  EXPECT_EQ(result.status, TrackingState::kTracking);
  EXPECT_LT(OffTruth(result), 0.01);
}

}  // namespace
}  // namespace planar_vslam
