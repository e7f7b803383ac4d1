#include "planar_vslam/pipeline/sweep_collector.h"

#include <gtest/gtest.h>

#include "planar_vslam/map/map_edit.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

class SweepCollectorTest : public ::testing::Test {
 protected:
  SweepCollectorTest() : world_(test::MakeSyntheticWorld({})), map_(world_.map) {}

  // A frame that stands `x` metres past the third keyframe by odometry and by pose, with one sweep taken there.
  void AddFrame(double x, bool on_odometry = false) {
    FramePacket packet;
    packet.T_odom_base = Rigid2(x, 0.0, 0.0);
    packet.scans.push_back({PlanarScan{}, Rigid3(), Rigid2(0.01, 0.0, 0.0)});
    trajectory_.Add(
        {Timestamp{++frame_}, KeyframeId{2}, Embed3(Rigid2(x, 0.0, 0.0)), world_.T_base_camera, on_odometry});
    collector_.Add(packet, trajectory_.size() - 1);
  }
  std::size_t Taken() {
    std::size_t count = 0;
    for (const AddSweeps& edit : collector_.Take(map_, trajectory_, true)) count += edit.sweeps.size();
    return count;
  }

  test::SyntheticWorld world_;
  Map map_;
  TrajectoryRecorder trajectory_;
  SweepCollector collector_;
  std::int64_t frame_ = 0;
};

TEST_F(SweepCollectorTest, SweepsOfFramesOnOdometryWaitForTheirKeyframe) {
  AddFrame(0.1);
  AddFrame(0.2, true);
  const std::vector<AddSweeps> edits = collector_.Take(map_, trajectory_, false);
  ASSERT_EQ(edits.size(), 1U);
  EXPECT_EQ(edits[0].sweeps.size(), 1U);
  EXPECT_EQ(Taken(), 1U);
}

TEST_F(SweepCollectorTest, SweepsOfPosesThatWereRefutedAreDropped) {
  AddFrame(0.1);
  AddFrame(0.2, true);
  collector_.DropOnOdometry(trajectory_);
  EXPECT_EQ(Taken(), 1U) << "the one that was seen";
}

TEST_F(SweepCollectorTest, SweepsGoToTheKeyframeOfTheirFrame) {
  AddFrame(0.1);
  const std::vector<AddSweeps> edits = collector_.Take(map_, trajectory_, true);
  ASSERT_EQ(edits.size(), 1U);
  EXPECT_EQ(edits[0].keyframe, KeyframeId{2});
  ASSERT_EQ(edits[0].sweeps.size(), 1U);
  EXPECT_NEAR(edits[0].sweeps[0].T_keyframe_base.translation.x(), 0.11, 1e-9);
  EXPECT_EQ(Taken(), 0U) << "each is handed out once";
}

TEST_F(SweepCollectorTest, SweepsFollowAFrameWhoseKeyframeIsCulled) {
  AddFrame(0.1);
  const Keyframe &anchor = map_.keyframes.At(KeyframeId{1}), &culled = map_.keyframes.At(KeyframeId{2});
  const Rigid2 expected = ProjectToPlane(culled.T_map_base) * Rigid2(0.11, 0.0, 0.0);
  trajectory_.OnCulled({test::Culled(map_, KeyframeId{2})});
  const std::vector<AddSweeps> edits = collector_.Take(Apply(map_, {EraseKeyframe{KeyframeId{2}}}), trajectory_, true);
  ASSERT_EQ(edits.size(), 1U);
  EXPECT_EQ(edits[0].keyframe, KeyframeId{1});
  const Rigid2 found = ProjectToPlane(anchor.T_map_base) * edits[0].sweeps.at(0).T_keyframe_base;
  EXPECT_LT((found.translation - expected.translation).norm(), 1e-9);
}

TEST_F(SweepCollectorTest, SweepsWaitUntilTheMapIsMetric) {
  map_ = Apply(std::move(map_), {SetMetric{false}});
  AddFrame(0.1);
  EXPECT_EQ(Taken(), 0U);
  map_ = Apply(std::move(map_), {SetMetric{true}});
  EXPECT_EQ(Taken(), 1U);
}

TEST_F(SweepCollectorTest, AStandingRobotKeepsAFewSweepsADrivingOneAll) {
  for (int i = 0; i < 1000; ++i) AddFrame(0.0);
  const std::size_t standing = Taken();
  EXPECT_GE(standing, 2U);
  EXPECT_LE(standing, 20U);
  for (int i = 1; i <= 20; ++i) AddFrame(0.07 * i);
  EXPECT_EQ(Taken(), 20U);
}

TEST_F(SweepCollectorTest, AKeyframeTakesTheLatestSweepByOdometry) {
  AddFrame(0.1);
  AddFrame(0.2);
  EXPECT_FALSE(collector_.TakeLatest(Rigid2(0.25, 0.0, 0.0), Timestamp::FromSeconds(9.0)).has_value()) << "too old";
  const auto own = collector_.TakeLatest(Rigid2(0.25, 0.0, 0.0), Timestamp::FromSeconds(0.1));
  ASSERT_TRUE(own.has_value());
  EXPECT_NEAR(own->T_keyframe_base.translation.x(), 0.21 - 0.25, 1e-9);
  EXPECT_EQ(Taken(), 1U) << "the other one still waits";
}

}  // namespace
}  // namespace planar_vslam
