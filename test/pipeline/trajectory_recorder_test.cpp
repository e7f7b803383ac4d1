#include "planar_vslam/pipeline/trajectory_recorder.h"

#include <gtest/gtest.h>

#include "planar_vslam/map/map_edit.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

// Frames every 5 cm along the path of the synthetic world, each relative to the keyframe before it.
class TrajectoryRecorderTest : public ::testing::Test {
 protected:
  TrajectoryRecorderTest() : world_(test::MakeSyntheticWorld({})), map_(world_.map) {
    for (int i = 0; i < 35; ++i) {
      const double x = 0.05 * i + 0.01;
      const KeyframeId reference{static_cast<std::uint32_t>(x / 0.25)};
      const Rigid3 pose = test::SyntheticPose(x);
      recorder_.Add({Timestamp::FromSeconds(0.1 * i), reference, world_.true_poses[reference.value].Inverse() * pose,
                     world_.T_base_camera});
      truth_.push_back(pose);
    }
  }
  void ExpectPoses(const std::vector<Rigid3>& expected, double tolerance) const {
    const auto poses = recorder_.Poses(map_);
    ASSERT_EQ(poses.size(), expected.size());
    for (std::size_t i = 0; i < poses.size(); ++i) {
      EXPECT_LT(LogSe3(expected[i].Inverse() * poses[i].second).norm(), tolerance) << "frame " << i;
    }
  }
  // Culls a keyframe from the map as the back end does, and tells the recorder.
  void Cull(KeyframeId id) {
    const KeyframeId anchor{id.value - 1};
    const Rigid3 T_anchor_culled = map_.keyframes.At(anchor).T_map_base.Inverse() * map_.keyframes.At(id).T_map_base;
    map_ = Apply(std::move(map_), {EraseKeyframe{id}});
    recorder_.OnCulled({{id, anchor, T_anchor_culled, world_.T_base_camera, world_.T_base_camera}});
  }
  // The map scaled as scale recovery does, and where the recorded bases then are: camera centres scale, extrinsics do
  // not.
  std::vector<Rigid3> Scale(double scale) {
    map_ = Apply(std::move(map_), {TransformMap{scale, Rigid3()}});
    recorder_.OnScaled(map_, scale);
    std::vector<Rigid3> scaled;
    for (const Rigid3& pose : truth_) {
      Rigid3 T_map_camera = pose * world_.T_base_camera;
      T_map_camera.translation *= scale;
      scaled.push_back(T_map_camera * world_.T_base_camera.Inverse());
    }
    return scaled;
  }

  test::SyntheticWorld world_;
  Map map_;
  TrajectoryRecorder recorder_;
  std::vector<Rigid3> truth_;
};

TEST_F(TrajectoryRecorderTest, GivesBackWhatWasRecorded) {
  EXPECT_EQ(recorder_.size(), truth_.size());
  ExpectPoses(truth_, 1e-9);
  EXPECT_EQ(recorder_.Poses(map_)[3].first, Timestamp::FromSeconds(0.3));
}

TEST_F(TrajectoryRecorderTest, FollowsKeyframesThatMove) {
  const Rigid3 T_new_old = Embed3(Rigid2(1.0, -2.0, 0.5));
  map_ = Apply(std::move(map_), {TransformMap{1.0, T_new_old}});
  for (Rigid3& pose : truth_) pose = T_new_old * pose;
  ExpectPoses(truth_, 1e-9);
}

TEST_F(TrajectoryRecorderTest, ReferencesToCulledKeyframesGoToTheirAnchors) {
  Cull(KeyframeId{3});
  Cull(KeyframeId{5});
  ExpectPoses(truth_, 1e-9);
}

TEST_F(TrajectoryRecorderTest, AnchorsMayBeCulledInTurn) {
  Cull(KeyframeId{4});
  Cull(KeyframeId{3});
  Cull(KeyframeId{2});
  ExpectPoses(truth_, 1e-9);
  const Rigid3 T_new_old = Embed3(Rigid2(0.3, 0.2, -0.5));
  map_ = Apply(std::move(map_), {TransformMap{1.0, T_new_old}});
  for (Rigid3& pose : truth_) pose = T_new_old * pose;
  ExpectPoses(truth_, 1e-9);
}

TEST_F(TrajectoryRecorderTest, ScalesWithTheMap) { ExpectPoses(Scale(2.5), 1e-9); }

TEST_F(TrajectoryRecorderTest, ScalesFramesOfCulledKeyframesToo) {
  Cull(KeyframeId{4});
  Cull(KeyframeId{3});
  ExpectPoses(Scale(2.5), 1e-6);
}

TEST_F(TrajectoryRecorderTest, TheFrameThatBecameAKeyframeFollowsIt) {
  const KeyframeId last{map_.next_keyframe_id - 1};
  const Timestamp stamp = Timestamp::FromSeconds(3.4);  // the last frame recorded
  recorder_.Reanchor(stamp, last);
  truth_.back() = map_.keyframes.At(last).T_map_base;
  ExpectPoses(truth_, 1e-9);
}

TEST_F(TrajectoryRecorderTest, FramesOnOdometryHangOnTheKeyframeThatEndsThem) {
  const KeyframeId last{map_.next_keyframe_id - 1}, before{map_.next_keyframe_id - 2};
  TrajectoryRecorder recorder;
  const auto add = [&](double t, double x, bool on_odometry) {
    recorder.Add({Timestamp::FromSeconds(t), before, Embed3(Rigid2(x, 0.0, 0.0)), world_.T_base_camera, on_odometry});
  };
  add(1.0, 0.1, false);
  add(1.1, 0.2, true);
  add(1.2, 0.3, true);
  recorder.Reanchor(Timestamp::FromSeconds(1.2), last);
  EXPECT_EQ(recorder.Anchor(map_, 0)->first, before);
  EXPECT_EQ(recorder.Anchor(map_, 1)->first, last);
  EXPECT_EQ(recorder.Anchor(map_, 2)->first, last);
  EXPECT_NEAR(recorder.Anchor(map_, 1)->second.translation.x(), -0.1, 1e-12);
  EXPECT_FALSE(recorder.IsOnOdometry(1));
}

TEST_F(TrajectoryRecorderTest, ForgetsTheOldestFramesBeyondItsCapacity) {
  constexpr std::size_t kCapacity = 10;
  TrajectoryRecorder recorder(kCapacity);
  for (std::size_t i = 0; i < truth_.size(); ++i) {
    const KeyframeId reference{static_cast<std::uint32_t>((0.05 * static_cast<double>(i) + 0.01) / 0.25)};
    recorder.Add({Timestamp::FromSeconds(0.1 * static_cast<double>(i)), reference,
                  world_.true_poses[reference.value].Inverse() * truth_[i], world_.T_base_camera});
    EXPECT_LE(recorder.Poses(map_).size(), 2 * kCapacity);
  }
  EXPECT_EQ(recorder.size(), truth_.size()) << "numbers go on counting";
  EXPECT_FALSE(recorder.Anchor(map_, 0).has_value());
  ASSERT_TRUE(recorder.Anchor(map_, truth_.size() - 1).has_value());
  const auto poses = recorder.Poses(map_);
  ASSERT_GE(poses.size(), kCapacity);
  EXPECT_LT(LogSe3(poses.back().second.Inverse() * truth_.back()).norm(), 1e-9);
}

}  // namespace
}  // namespace planar_vslam
