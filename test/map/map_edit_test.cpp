// The meaning of each step.
#include "planar_vslam/map/map_edit.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/random_map.h"
#include "support/support.h"

namespace planar_vslam::test {
namespace {

const std::vector<std::string> kSound;
constexpr std::uint32_t kFree = 4;  // first keypoint that SmallMap() leaves free

class MapEditTest : public testing::Test {
 protected:
  // Four keyframes of eight keypoints in an odometry chain; landmark 0 in all, 1 in 0-2, 2 in 1-3, 3 in 2-3.
  MapEditTest() {
    map_.octave_scales = OctaveScales();
    MapEdit edit;
    for (std::uint32_t i = 0; i < 4; ++i) {
      Keyframe keyframe = RandomKeyframe(generator_, 8);
      if (i > 0) keyframe.odometry_link = MotionLink{K(i - 1), RandomOdometry(generator_)};
      edit.push_back(AddKeyframe{K(i), keyframe});
    }
    edit.push_back(AddLandmark{L(0), LandmarkSeenBy(generator_, {K(0), K(1), K(2), K(3)}, 0)});
    edit.push_back(AddLandmark{L(1), LandmarkSeenBy(generator_, {K(0), K(1), K(2)}, 1)});
    edit.push_back(AddLandmark{L(2), LandmarkSeenBy(generator_, {K(1), K(2), K(3)}, 2)});
    edit.push_back(AddLandmark{L(3), LandmarkSeenBy(generator_, {K(2), K(3)}, 3)});
    Change(edit);
  }

  void Change(const MapEdit& edit) {
    map_ = Apply(std::move(map_), edit);
    EXPECT_EQ(Validate(map_), kSound);
  }
  std::size_t Observations(std::uint32_t landmark) const { return map_.landmarks.At(L(landmark)).observations.size(); }
  LandmarkId At(std::uint32_t keyframe, std::uint32_t keypoint) const {
    return map_.keyframes.At(K(keyframe)).landmarks.at(keypoint);
  }
  Rigid2 Link(std::uint32_t keyframe) const { return map_.keyframes.At(K(keyframe)).odometry_link->motion.T_i_j; }

  std::mt19937 generator_{11};
  Map map_;
};

TEST_F(MapEditTest, AddKeyframeConnectsTheLandmarksItRefersTo) {
  AddKeyframe step{K(4), RandomKeyframe(generator_, 8)};
  step.keyframe.landmarks[5] = L(3);
  step.keyframe.landmarks[6] = L(3);   // a second sighting in one image cannot be
  step.keyframe.landmarks[7] = L(77);  // unknown
  Change({step});
  EXPECT_EQ(Observations(3), 3U);
  EXPECT_EQ(map_.landmarks.At(L(3)).observations.back().keypoint, 5U);
  EXPECT_EQ(At(4, 5), L(3));
  EXPECT_FALSE(At(4, 6).valid());
  EXPECT_FALSE(At(4, 7).valid());
  EXPECT_EQ(map_.next_keyframe_id, 5U);
}

TEST_F(MapEditTest, AddKeyframeDropsALinkFromAKeyframeThatIsGone) {
  AddKeyframe step{K(4), RandomKeyframe(generator_, 8)};
  step.keyframe.odometry_link = MotionLink{K(3), RandomOdometry(generator_)};
  Change({EraseKeyframe{K(3)}, step});
  EXPECT_FALSE(map_.keyframes.At(K(4)).odometry_link.has_value());
}

TEST_F(MapEditTest, AddLandmarkSortsObservationsAndMaySkipIds) {
  Change({AddLandmark{L(9), LandmarkSeenBy(generator_, {K(3), K(0), K(2)}, kFree)}});
  const auto& observations = map_.landmarks.At(L(9)).observations;
  ASSERT_EQ(observations.size(), 3U);
  EXPECT_EQ(observations[0].keyframe, K(0));
  EXPECT_EQ(observations[2].keyframe, K(3));
  EXPECT_EQ(At(2, kFree), L(9));
  EXPECT_EQ(map_.next_landmark_id, 10U);
}

TEST_F(MapEditTest, AddObservationIsIgnoredWhereThereIsNoRoom) {
  const Map before = map_;
  Change({AddObservation{L(3), {K(0), 0}},         // keypoint taken
          AddObservation{L(3), {K(2), kFree}},     // already observed there
          AddObservation{L(3), {K(40), kFree}},    // no such keyframe
          AddObservation{L(30), {K(0), kFree}}});  // no such landmark
  EXPECT_TRUE(Equal(map_, before));
  Change({AddObservation{L(3), {K(0), kFree}}});
  EXPECT_EQ(Observations(3), 3U);
  EXPECT_EQ(At(0, kFree), L(3));
}

TEST_F(MapEditTest, ALandmarkLeftWithOneObservationGoes) {
  Change({EraseObservation{L(1), K(1)}});
  EXPECT_EQ(Observations(1), 2U);
  EXPECT_FALSE(At(1, 1).valid());
  Change({EraseObservation{L(1), K(0)}});
  EXPECT_FALSE(map_.landmarks.Contains(L(1)));
  EXPECT_FALSE(At(2, 1).valid());
}

TEST_F(MapEditTest, ALandmarkThatRegainsObservationsWithinTheEditStays) {
  Change({EraseObservation{L(3), K(2)}, AddObservation{L(3), {K(2), kFree}}});
  EXPECT_EQ(Observations(3), 2U);
  EXPECT_EQ(At(2, kFree), L(3));
}

TEST_F(MapEditTest, ASingleObservationIsKeptOnlyInTheEditThatCreatesIt) {
  Change({AddLandmark{L(4), LandmarkSeenBy(generator_, {K(0), K(1)}, kFree)}, EraseObservation{L(4), K(0)},
          AddLandmark{L(5), LandmarkSeenBy(generator_, {K(0)}, kFree)}});
  EXPECT_EQ(Observations(4), 1U);
  EXPECT_EQ(Observations(5), 1U);
  Change({SetLandmarkPosition{L(5), {1, 2, 3}}, AddObservation{L(4), {K(3), kFree}}});
  EXPECT_EQ(Observations(4), 2U);
  EXPECT_EQ(Observations(5), 1U);
  Change({EraseObservation{L(4), K(3)}});
  EXPECT_FALSE(map_.landmarks.Contains(L(4)));
}

TEST_F(MapEditTest, ErasedLandmarksStayGoneForTheRestOfTheEdit) {
  Change({EraseLandmarks{{L(2), L(0), L(50), L(2)}}, AddObservation{L(0), {K(0), kFree}},
          SetLandmarkPosition{L(0), {1, 2, 3}}, MergeLandmarks{L(1), L(2)}, MergeLandmarks{L(2), L(3)},
          CountSightings{{L(2)}, {}}});
  EXPECT_EQ(map_.landmarks.size(), 2U);
  EXPECT_EQ(Observations(1), 3U);
  EXPECT_EQ(Observations(3), 2U);
  EXPECT_FALSE(At(0, 0).valid());
}

TEST_F(MapEditTest, ErasingAKeyframeErasesItsObservations) {
  Change({EraseKeyframe{K(3)}});
  EXPECT_FALSE(map_.keyframes.Contains(K(3)));
  EXPECT_EQ(Observations(0), 3U);
  EXPECT_EQ(Observations(2), 2U);
  EXPECT_FALSE(map_.landmarks.Contains(L(3)));
  EXPECT_EQ(map_.landmarks.At(L(0)).created_by, K(3)) << "who created it stays";
  EXPECT_EQ(map_.next_keyframe_id, 4U);
}

TEST_F(MapEditTest, OdometryIsRecomposedAcrossErasedKeyframes) {
  const Rigid2 T_0_3 = Link(1) * Link(2) * Link(3);
  for (const auto& order :
       {MapEdit{EraseKeyframe{K(1)}, EraseKeyframe{K(2)}}, MapEdit{EraseKeyframe{K(2)}, EraseKeyframe{K(1)}}}) {
    const Map culled = Apply(map_, order);
    EXPECT_EQ(Validate(culled), kSound);
    const MotionLink& link = culled.keyframes.At(K(3)).odometry_link.value();
    EXPECT_EQ(link.from, K(0));
    EXPECT_NEAR((link.motion.T_i_j.translation - T_0_3.translation).norm(), 0.0, 1e-12);
    EXPECT_NEAR(WrapAngle(link.motion.T_i_j.angle - T_0_3.angle), 0.0, 1e-12);
    EXPECT_NEAR(link.motion.seconds, 3 * 0.5, 1e-12);
    EXPECT_GT(link.motion.covariance(0, 0), map_.keyframes.At(K(3)).odometry_link->motion.covariance(0, 0));
  }
}

TEST_F(MapEditTest, EveryLinkToAnErasedKeyframeIsRecomposed) {
  AddKeyframe branch{K(4), RandomKeyframe(generator_, 8)};
  branch.keyframe.odometry_link = MotionLink{K(2), RandomOdometry(generator_)};
  Change({branch});
  const Rigid2 T_1_3 = Link(2) * Link(3), T_1_4 = Link(2) * Link(4);
  Change({EraseKeyframe{K(2)}});
  EXPECT_NEAR((Link(3).translation - T_1_3.translation).norm(), 0.0, 1e-12);
  EXPECT_NEAR((Link(4).translation - T_1_4.translation).norm(), 0.0, 1e-12);
}

TEST_F(MapEditTest, WithoutAnEarlierLinkTheLaterOneIsDropped) {
  Change({EraseKeyframe{K(0)}});
  EXPECT_FALSE(map_.keyframes.At(K(1)).odometry_link.has_value());
  EXPECT_TRUE(map_.keyframes.At(K(2)).odometry_link.has_value());
}

TEST_F(MapEditTest, MergeMovesObservationsAndAddsCounters) {
  Change({EraseObservation{L(0), K(2)}, EraseObservation{L(0), K(3)},
          CountSightings{{L(0), L(3), L(3)}, {L(3)}}});  // 0 in 0-1, 3 in 2-3
  const Eigen::Vector3d p_into = map_.landmarks.At(L(0)).p_map;
  Change({MergeLandmarks{L(3), L(0)}});
  EXPECT_FALSE(map_.landmarks.Contains(L(3)));
  const Landmark& into = map_.landmarks.At(L(0));
  EXPECT_EQ(into.observations.size(), 4U);
  EXPECT_EQ(At(2, 3), L(0));
  EXPECT_EQ(into.p_map, p_into);
  EXPECT_EQ(into.predicted_visible, 2U + 3U);
  EXPECT_EQ(into.found, 1U + 2U);
}

TEST_F(MapEditTest, MergeFreesKeypointsWhereBothAreSeen) {
  Change({MergeLandmarks{L(1), L(2)}});  // 1 in 0-2, 2 in 1-3
  EXPECT_EQ(Observations(2), 4U);
  EXPECT_EQ(At(0, 1), L(2));
  EXPECT_FALSE(At(1, 1).valid());
  EXPECT_FALSE(At(2, 1).valid());
  EXPECT_EQ(At(1, 2), L(2));
}

TEST_F(MapEditTest, MergeOfALandmarkWithItselfOrAStrangerChangesNothing) {
  const Map before = map_;
  Change({MergeLandmarks{L(1), L(1)}, MergeLandmarks{L(1), L(20)}, MergeLandmarks{L(20), L(1)}});
  EXPECT_TRUE(Equal(map_, before));
}

TEST_F(MapEditTest, StepsNamingIdsThatAreGoneArePassedOver) {
  const Map before = map_;
  Change({EraseObservation{L(9), K(0)}, EraseObservation{L(3), K(0)}, EraseLandmarks{{L(9)}}, EraseKeyframe{K(9)},
          SetKeyframePose{K(9), Rigid3()}, SetLandmarkPosition{L(9), {1, 2, 3}}, CountSightings{{L(9)}, {L(9)}}});
  EXPECT_TRUE(Equal(map_, before));
}

TEST_F(MapEditTest, SetOffFloorTakesTheNamedOnesOffTheFloor) {
  Change({SetOffFloor{{K(1), K(9)}}});
  EXPECT_TRUE(map_.keyframes.At(K(0)).on_floor);
  EXPECT_FALSE(map_.keyframes.At(K(1)).on_floor);
}

TEST_F(MapEditTest, AnotherImageOffsetMovesBasesUnderTheirCameras) {
  map_.keyframes.Edit(K(1)).moment = {Eigen::Vector3d(0.3, 0.0, 1.0), -0.01};
  const Keyframe before = map_.keyframes.At(K(1)), still = map_.keyframes.At(K(0));
  Change({SetImageOffset{-0.03}});
  const Keyframe& after = map_.keyframes.At(K(1));
  EXPECT_LT(LogSe3(before.T_map_camera().Inverse() * after.T_map_camera()).norm(), 1e-12);
  // Taken 0.02 s earlier than thought: the base is that much farther on.
  EXPECT_LT((LogSe2(ProjectToPlane(before.T_map_base.Inverse() * after.T_map_base)) - Eigen::Vector3d(0.006, 0.0, 0.02))
                .norm(),
            1e-9);
  EXPECT_EQ(after.moment.offset, -0.03);
  EXPECT_EQ(LogSe3(still.T_map_base.Inverse() * map_.keyframes.At(K(0)).T_map_base).norm(), 0.0);
  const Rigid3 T_map_base = after.T_map_base;
  Change({SetImageOffset{0.05}, SetImageOffset{-0.03}});
  EXPECT_LT(LogSe3(T_map_base.Inverse() * map_.keyframes.At(K(1)).T_map_base).norm(), 1e-12);
}

TEST_F(MapEditTest, CountSightingsCountsRepeats) {
  Change({CountSightings{{L(2), L(0), L(2)}, {L(2)}}});
  EXPECT_EQ(map_.landmarks.At(L(2)).predicted_visible, 3U);
  EXPECT_EQ(map_.landmarks.At(L(2)).found, 2U);
  EXPECT_EQ(map_.landmarks.At(L(0)).predicted_visible, 2U);
  EXPECT_EQ(map_.landmarks.At(L(0)).found, 1U);
}

TEST_F(MapEditTest, SetMetricIsKept) {
  Change({SetMetric{}});
  EXPECT_TRUE(map_.metric);
  Change({SetMetric{false}});
  EXPECT_FALSE(map_.metric);
}

TEST_F(MapEditTest, TransformMapKeepsReprojections) {
  const Map before = map_;
  const double scale = 2.5;
  const Rigid3 T_new_old = RandomRigid3(generator_, 4.0);
  Change({TransformMap{scale, T_new_old}});
  for (const auto& [id, keyframe] : before.keyframes) {
    const Keyframe& now = map_.keyframes.At(id);
    EXPECT_EQ(now.T_base_camera.translation, keyframe.T_base_camera.translation) << "stays metric";
    for (const auto& [landmark_id, landmark] : before.landmarks) {
      const Eigen::Vector3d p_camera = keyframe.T_map_camera().Inverse() * landmark.p_map;
      const Eigen::Vector3d p_camera_now = now.T_map_camera().Inverse() * map_.landmarks.At(landmark_id).p_map;
      EXPECT_NEAR((p_camera_now - scale * p_camera).norm(), 0.0, 1e-9);
    }
  }
  for (const auto& [id, landmark] : before.landmarks) {
    const Landmark& now = map_.landmarks.At(id);
    EXPECT_NEAR(now.max_distance, scale * landmark.max_distance, 1e-9);
    EXPECT_NEAR((now.view_direction - T_new_old.rotation * landmark.view_direction).norm(), 0.0, 1e-9);
    EXPECT_EQ(now.descriptor, landmark.descriptor);
  }
}

TEST_F(MapEditTest, TransformMapIsUndoneByItsInverse) {
  const Rigid3 T_new_old = RandomRigid3(generator_, 4.0);
  const Map before = map_;
  const Rigid3 T_inverse{T_new_old.Inverse().rotation, T_new_old.Inverse().translation / 2.0};
  Change({TransformMap{2.0, T_new_old}, TransformMap{0.5, T_inverse}});
  for (const auto& [id, keyframe] : before.keyframes) {
    const Rigid3 difference = keyframe.T_map_base.Inverse() * map_.keyframes.At(id).T_map_base;
    EXPECT_NEAR(LogSe3(difference).norm(), 0.0, 1e-9);
  }
}

using MapEditDeathTest = MapEditTest;

TEST_F(MapEditDeathTest, BrokenPromisesStopTheProgram) {
  const auto landmark = LandmarkSeenBy(generator_, {K(0), K(1)}, kFree);
  EXPECT_DEATH(Apply(map_, {AddKeyframe{K(3), RandomKeyframe(generator_, 8)}}), "check failed");
  EXPECT_DEATH(Apply(map_, {EraseKeyframe{K(3)}, AddKeyframe{K(3), RandomKeyframe(generator_, 8)}}), "check failed");
  EXPECT_DEATH(Apply(map_, {EraseLandmarks{{L(3)}}, AddLandmark{L(3), landmark}}), "check failed");
  EXPECT_DEATH(Apply(map_, {AddLandmark{L(4), LandmarkSeenBy(generator_, {K(0), K(1)}, 0)}}), "free keypoint");
  EXPECT_DEATH(Apply(map_, {AddLandmark{L(4), LandmarkSeenBy(generator_, {K(0), K(9)}, kFree)}}), "free keypoint");
  EXPECT_DEATH(Apply(map_, {AddLandmark{L(4), Landmark{}}}), "no observations");
  EXPECT_DEATH(Apply(map_, {AddObservation{L(3), {K(0), 99}}}), "keypoint=99 of 8");
}

// Where a sweep's base was, in the plane of the map.
Rigid2 PlaceOf(const Keyframe& keyframe, const LaserSweep& sweep) {
  return ProjectToPlane(keyframe.T_map_base) * sweep.T_keyframe_base;
}

TEST_F(MapEditTest, SweepsOfAnErasedKeyframeStayWhereTheyWere) {
  for (const std::uint32_t erased : {2U, 0U}) {  // to the one before; the first's to the one after
    const Keyframe from = map_.keyframes.At(K(erased));
    const KeyframeId home = K(erased == 0 ? 1 : erased - 1);
    Change({SetKeyframePose{home, from.T_map_base * Embed3(Rigid2(0.3, 0.0, 0.2))}});
    const std::size_t before = map_.keyframes.At(home).sweeps.size();
    const LaserSweep sweep = RandomSweep(generator_);
    Change({AddSweeps{K(erased), {sweep}}, EraseKeyframe{K(erased)}});
    const std::vector<LaserSweep>& sweeps = map_.keyframes.At(home).sweeps;
    ASSERT_EQ(sweeps.size(), before + from.sweeps.size() + 1);
    EXPECT_EQ(sweeps.back().scan, sweep.scan);
    const Rigid2 expected = PlaceOf(from, sweep), found = PlaceOf(map_.keyframes.At(home), sweeps.back());
    EXPECT_LT((expected.translation - found.translation).norm(), 1e-9);
    EXPECT_LT(std::abs(WrapAngle(expected.angle - found.angle)), 1e-9);
  }
}

TEST_F(MapEditTest, SweepsForAKeyframeThatIsGoneArePassedOver) {
  Change({EraseKeyframe{K(1)}});
  const Map before = map_;
  Change({AddSweeps{K(1), {RandomSweep(generator_)}}});
  EXPECT_TRUE(Equal(before, map_));
}

TEST_F(MapEditTest, LaserLinksGoAcrossAnErasedKeyframe) {
  const PlanarMotion to_1 = RandomOdometry(generator_), to_2 = RandomOdometry(generator_),
                     to_3 = RandomOdometry(generator_);
  Change(
      {AddLaserLinks{K(1), {{K(0), to_1}}}, AddLaserLinks{K(2), {{K(1), to_2}}}, AddLaserLinks{K(3), {{K(1), to_3}}}});
  Change({EraseKeyframe{K(1)}});
  for (const auto& [id, step] : {std::pair(K(2), to_2), std::pair(K(3), to_3)}) {
    const std::vector<MotionLink>& links = map_.keyframes.At(id).laser_links;
    ASSERT_EQ(links.size(), 1U);
    EXPECT_EQ(links[0].from, K(0));
    EXPECT_LT(LogSe2((to_1.T_i_j * step.T_i_j).Inverse() * links[0].motion.T_i_j).norm(), 1e-12);
  }
  Change({EraseKeyframe{K(0)}});
  EXPECT_TRUE(map_.keyframes.At(K(2)).laser_links.empty()) << "nothing to continue from";
}

TEST_F(MapEditTest, LaserLinksThatCannotBeArePassedOver) {
  const PlanarMotion step = RandomOdometry(generator_);
  Change({AddLaserLinks{
      K(2),
      {{K(1), step}, {K(0), step}, {K(1), RandomOdometry(generator_)}, {K(2), step}, {K(3), step}, {K(9), step}}}});
  const std::vector<MotionLink>& links = map_.keyframes.At(K(2)).laser_links;
  ASSERT_EQ(links.size(), 2U);
  EXPECT_EQ(links[0].from, K(0));
  EXPECT_EQ(links[1].from, K(1));
  EXPECT_EQ(links[1].motion.T_i_j.angle, step.T_i_j.angle) << "the first one stays";
}

}  // namespace
}  // namespace planar_vslam::test
