#include "planar_vslam/backend/map_correction.h"

#include <gtest/gtest.h>

#include <random>

#include "map_testing.h"
#include "support/support.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

constexpr double kRounding = 1e-9;

double Difference(const Rigid3& a, const Rigid3& b) { return LogSe3(a.Inverse() * b).norm(); }

class RebaseTest : public ::testing::TestWithParam<std::uint32_t> {
 protected:
  RebaseTest() : generator_(GetParam()), world_(test::MakeSyntheticWorld({})), snapshot_(world_.map) {
    result_ = snapshot_;
    PlanarMotion laser;
    laser.covariance.setIdentity();
    structure_ = {MergeLandmarks{LandmarkId{4}, LandmarkId{3}},
                  EraseObservation{LandmarkId{7}, snapshot_.landmarks.At(LandmarkId{7}).observations.front().keyframe},
                  EraseOdometryLink{KeyframeId{5}}, AddLaserLinks{KeyframeId{6}, {{KeyframeId{1}, laser}}}};
    MapEdit edit = RandomMoves(snapshot_, 1.0);
    edit.insert(edit.end(), structure_.begin(), structure_.end());
    result_ = Apply(snapshot_, edit);
    correction_ = CorrectionBetween(snapshot_, result_, structure_);
  }

  MapEdit RandomMoves(const Map& map, double extent) {
    MapEdit edit;
    for (const auto& [id, keyframe] : map.keyframes) {
      edit.emplace_back(SetKeyframePose{id, keyframe.T_map_base * test::RandomRigid3(generator_, extent)});
    }
    for (const auto& [id, landmark] : map.landmarks) {
      const Eigen::Vector3d step = test::RandomRigid3(generator_, extent).translation;
      edit.emplace_back(SetLandmarkPosition{id, landmark.p_map + step});
    }
    return edit;
  }
  // A keyframe added after the snapshot, linked to `from` if that is valid, and a landmark that it created.
  Map WithNew(Map map, KeyframeId from) {
    Keyframe keyframe;
    keyframe.T_map_base = test::RandomRigid3(generator_, 3.0);
    keyframe.T_base_camera = world_.T_base_camera;
    keyframe.features = test::Observe(world_, world_.true_poses[0] * world_.T_base_camera, 0.0, 1).features;
    keyframe.landmarks.resize(keyframe.features->keypoints.size());
    if (from.valid()) keyframe.odometry_link = MotionLink{from, PlanarMotion{}};
    const KeyframeId id{map.next_keyframe_id};
    Landmark landmark;
    landmark.p_map = test::RandomRigid3(generator_, 5.0).translation;
    landmark.observations = {{id, 0}};
    landmark.created_by = id;
    return Apply(std::move(map), {AddKeyframe{id, keyframe}, AddLandmark{LandmarkId{map.next_landmark_id}, landmark}});
  }
  Rigid3 MotionOf(KeyframeId id) const {
    return result_.keyframes.At(id).T_map_base * snapshot_.keyframes.At(id).T_map_base.Inverse();
  }

  std::mt19937 generator_;
  test::SyntheticWorld world_;
  Map snapshot_, result_;
  MapEdit structure_;
  MapCorrection correction_;
};

TEST_P(RebaseTest, OntoTheSnapshotItIsTheResultOfTheJob) {
  const Map rebased = Rebase(snapshot_, correction_);
  EXPECT_EQ(Validate(rebased), std::vector<std::string>{});
  test::ExpectSameMap(rebased, result_);
}

TEST_P(RebaseTest, KeyframesAndLandmarksOfBothKeepTheMotionTheyMadeSince) {
  const Map now = Apply(snapshot_, RandomMoves(snapshot_, 0.1));
  const Map rebased = Rebase(now, correction_);
  EXPECT_EQ(Validate(rebased), std::vector<std::string>{});
  for (const auto& [id, keyframe] : snapshot_.keyframes) {
    const Rigid3 since = keyframe.T_map_base.Inverse() * now.keyframes.At(id).T_map_base;
    const Rigid3 kept = result_.keyframes.At(id).T_map_base.Inverse() * rebased.keyframes.At(id).T_map_base;
    EXPECT_LT(Difference(since, kept), kRounding) << id.value;
  }
  for (const auto& [id, landmark] : rebased.landmarks) {
    const Eigen::Vector3d since = now.landmarks.At(id).p_map - snapshot_.landmarks.At(id).p_map;
    const Eigen::Vector3d kept = landmark.p_map - result_.landmarks.At(id).p_map;
    EXPECT_LT((MotionOf(landmark.created_by).rotation * since - kept).norm(), kRounding) << id.value;
  }
}

TEST_P(RebaseTest, WhatWasAddedSinceMovesWithTheKeyframeItHangsOn) {
  const KeyframeId last = std::prev(snapshot_.keyframes.end())->first;
  Map now = WithNew(snapshot_, KeyframeId{3});                // on an older keyframe
  now = WithNew(std::move(now), KeyframeId{last.value + 1});  // and one on that
  now = WithNew(std::move(now), KeyframeId{});                // and one without odometry
  const Map rebased = Rebase(now, correction_);
  EXPECT_EQ(Validate(rebased), std::vector<std::string>{});
  const KeyframeId anchors[] = {KeyframeId{3}, KeyframeId{3}, last};
  for (std::uint32_t k = 0; k < 3; ++k) {
    const KeyframeId id{last.value + 1 + k};
    const Rigid3 before = now.keyframes.At(anchors[k]).T_map_base.Inverse() * now.keyframes.At(id).T_map_base;
    const Rigid3 after = rebased.keyframes.At(anchors[k]).T_map_base.Inverse() * rebased.keyframes.At(id).T_map_base;
    EXPECT_LT(Difference(before, after), kRounding) << k;
    const LandmarkId landmark{snapshot_.next_landmark_id + k};
    const Eigen::Vector3d p_base = now.keyframes.At(id).T_map_base.Inverse() * now.landmarks.At(landmark).p_map;
    EXPECT_LT((rebased.keyframes.At(id).T_map_base * p_base - rebased.landmarks.At(landmark).p_map).norm(), kRounding);
  }
}

TEST_P(RebaseTest, WhatIsGoneByNowIsPassedOver) {
  EraseLandmarks erased{{LandmarkId{3}, LandmarkId{7}}};
  for (int k = 0; k < 20; ++k) erased.ids.push_back(LandmarkId{static_cast<std::uint32_t>(generator_()) % 200});
  Map now = WithNew(snapshot_, KeyframeId{2});
  const KeyframeId added{snapshot_.next_keyframe_id};
  now = Apply(std::move(now), {erased, EraseKeyframe{KeyframeId{2}}, EraseKeyframe{KeyframeId{6}}});
  const Map rebased = Rebase(now, correction_);
  EXPECT_EQ(Validate(rebased), std::vector<std::string>{});
  EXPECT_EQ(rebased.keyframes.size(), now.keyframes.size());
  for (const auto& [id, keyframe] : rebased.keyframes) {
    // Its odometry was bridged to the keyframe before the one it hung on.
    const Rigid3 expected =
        id == added ? MotionOf(KeyframeId{1}) * now.keyframes.At(id).T_map_base : result_.keyframes.At(id).T_map_base;
    EXPECT_LT(Difference(keyframe.T_map_base, expected), kRounding) << id.value;
  }
  for (const auto& [id, landmark] : rebased.landmarks) {
    if (!snapshot_.landmarks.Contains(id) || !result_.landmarks.Contains(id)) continue;
    EXPECT_LT((landmark.p_map - result_.landmarks.At(id).p_map).norm(), kRounding) << id.value;
  }
  EXPECT_TRUE(rebased.landmarks.Contains(LandmarkId{4}) == now.landmarks.Contains(LandmarkId{4}))
      << "its other half is gone: it is not merged";
}

TEST_P(RebaseTest, AKeyframeAfterAJumpMovesWithWhatItSees) {
  Map now = WithNew(snapshot_, KeyframeId{});
  const KeyframeId added{snapshot_.next_keyframe_id}, seen{0};
  MapEdit sightings;
  std::uint32_t keypoint = 1;  // the first is taken
  for (const LandmarkId id : snapshot_.keyframes.At(seen).landmarks) {
    constexpr std::uint32_t kSome = 20;
    if (id.valid() && keypoint <= kSome) sightings.emplace_back(AddObservation{id, {added, keypoint++}});
  }
  now = Apply(std::move(now), sightings);
  const Map rebased = Rebase(now, correction_);
  EXPECT_EQ(Validate(rebased), std::vector<std::string>{});
  const Rigid3 expected = MotionOf(seen) * now.keyframes.At(added).T_map_base;
  EXPECT_LT(Difference(rebased.keyframes.At(added).T_map_base, expected), kRounding);
}

TEST_P(RebaseTest, AStepThatWasRefutedGoesThoughItsKeyframeIsGone) {
  const Map now = Apply(snapshot_, {EraseKeyframe{KeyframeId{5}}});
  ASSERT_EQ(now.keyframes.At(KeyframeId{6}).odometry_link->from, KeyframeId{4}) << "bridged across it";
  const Map rebased = Rebase(now, correction_);
  EXPECT_FALSE(rebased.keyframes.At(KeyframeId{6}).odometry_link.has_value());
  EXPECT_TRUE(rebased.keyframes.At(KeyframeId{7}).odometry_link.has_value());
}

INSTANTIATE_TEST_SUITE_P(Seeds, RebaseTest, ::testing::Range(1U, 9U));

TEST(Rebase, OfNothingChangesNothing) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  test::ExpectSameMap(Rebase(world.map, MapCorrection{}), world.map);
  test::ExpectSameMap(Rebase(world.map, CorrectionBetween(world.map, world.map, {})), world.map);
}

}  // namespace
}  // namespace planar_vslam
