#include "planar_vslam/pipeline/trajectory_recorder.h"

#include <gtest/gtest.h>

#include <cmath>

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
    recorder_.OnCulled({test::Culled(map_, id)});
    map_ = Apply(std::move(map_), {EraseKeyframe{id}});
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

TEST_F(TrajectoryRecorderTest, FramesBetweenTwoKeyframesShareWhatTheirsBecameOff) {
  TrajectoryRecorder recorder;
  const Rigid3 T_before_after =
      map_.keyframes.At(KeyframeId{2}).T_map_base.Inverse() * map_.keyframes.At(KeyframeId{3}).T_map_base;
  for (const double share : {0.0, 0.25, 0.5, 1.0}) {
    recorder.Add(
        {Timestamp::FromSeconds(share), KeyframeId{2}, ExpSe3(share * LogSe3(T_before_after)), world_.T_base_camera});
  }
  recorder.Reanchor(Timestamp::FromSeconds(1.0), KeyframeId{3});
  std::vector<Rigid3> expected;
  for (const auto& [stamp, pose] : recorder.Poses(map_)) expected.push_back(pose);
  const Eigen::Vector3d off(0.0, 0.04, 0.0);
  const Keyframe& after = map_.keyframes.At(KeyframeId{3});
  map_ = Apply(std::move(map_),
               {SetKeyframePose{KeyframeId{3}, after.T_map_base * Rigid3(Eigen::Quaterniond::Identity(), off)}});
  const auto poses = recorder.Poses(map_);
  for (const auto& [i, share] : {std::pair(0, 0.0), {1, 0.25}, {2, 0.5}, {3, 1.0}}) {
    const auto at = static_cast<std::size_t>(i);
    EXPECT_NEAR((expected[at].Inverse() * poses[at].second).translation.y(), share * off.y(), 1e-3) << share;
  }
}

TEST_F(TrajectoryRecorderTest, SoDoCulledKeyframes) {
  Cull(KeyframeId{3});
  const auto before = recorder_.Poses(map_);
  const Eigen::Vector3d off(0.0, 0.04, 0.0);
  const Keyframe& after = map_.keyframes.At(KeyframeId{4});
  map_ = Apply(std::move(map_),
               {SetKeyframePose{KeyframeId{4}, after.T_map_base * Rigid3(Eigen::Quaterniond::Identity(), off)}});
  const std::size_t at_culled = 15;  // 0.76 m
  const Rigid3 moved = before[at_culled].second.Inverse() * recorder_.Poses(map_)[at_culled].second;
  EXPECT_NEAR(moved.translation.y(), 0.5 * off.y(), 2e-3);
}

TEST_F(TrajectoryRecorderTest, ScalesWithTheMap) { ExpectPoses(Scale(2.5), 1e-9); }

TEST_F(TrajectoryRecorderTest, ScalesFramesOfCulledKeyframesToo) {
  Cull(KeyframeId{4});
  Cull(KeyframeId{3});
  ExpectPoses(Scale(2.5), 1e-6);
}

TEST_F(TrajectoryRecorderTest, CamerasStayWhereTheyAreWithAnotherImageOffset) {
  constexpr double kOffset = -0.04;  // s
  TrajectoryRecorder recorder;
  const auto moment_at = [](double x) { return ImageMoment{Eigen::Vector3d(0.4, 0.0, std::sin(5.0 * x)), 0.0}; };
  for (const auto& [id, keyframe] : world_.map.keyframes) map_.keyframes.Edit(id).moment = moment_at(0.25 * id.value);
  std::vector<Rigid3> cameras;
  std::vector<ImageMoment> moments;
  for (int i = 0; i < 35; ++i) {
    const double x = 0.05 * i + 0.01;
    const KeyframeId reference{static_cast<std::uint32_t>(x / 0.25)};
    const Rigid3 pose = test::SyntheticPose(x);
    moments.push_back(moment_at(x));
    recorder.Add({Timestamp::FromSeconds(0.1 * i), reference, world_.true_poses[reference.value].Inverse() * pose,
                  world_.T_base_camera, false, moments.back()});
    cameras.push_back(pose * world_.T_base_camera);
  }
  recorder.OnCulled({test::Culled(map_, KeyframeId{3})});
  map_ = Apply(std::move(map_), {EraseKeyframe{KeyframeId{3}}});
  recorder.OnImageOffset(map_, kOffset);
  map_ = Apply(std::move(map_), {SetImageOffset{kOffset}});
  const auto poses = recorder.Poses(map_);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Rigid3 T_base_camera = MountShift(moments[i], kOffset) * world_.T_base_camera;
    EXPECT_LT(LogSe3(cameras[i].Inverse() * poses[i].second * T_base_camera).norm(), 1e-9) << "frame " << i;
  }
}

TEST_F(TrajectoryRecorderTest, TheFrameThatBecameAKeyframeFollowsIt) {
  const KeyframeId last{map_.next_keyframe_id - 1};
  const Timestamp stamp = Timestamp::FromSeconds(3.4);  // the last frame recorded
  map_ = Apply(std::move(map_), {SetKeyframePose{last, truth_.back()}});
  recorder_.Reanchor(stamp, last);
  EXPECT_EQ(recorder_.Anchor(map_, truth_.size() - 1)->first, last);
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
