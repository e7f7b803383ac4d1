#include "planar_vslam/map/queries.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "planar_vslam/map/map_edit.h"
#include "support/random_map.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

constexpr double kBetweenKeyframes = 0.6;  // m along the path: keyframes stand at 0.5 and 0.75

class QueriesTest : public ::testing::Test {
 protected:
  test::SyntheticWorld world_ = test::MakeSyntheticWorld({});
  Rigid3 T_map_camera_ = test::SyntheticPose(kBetweenKeyframes) * world_.T_base_camera;
};

TEST_F(QueriesTest, NearbyKeyframesAreNearestFirstWithinDistanceAndAngle) {
  const std::vector<KeyframeId> near = NearbyKeyframes(world_.map, T_map_camera_, 0.38, DegreesToRadians(30.0), 10);
  ASSERT_EQ(near.size(), 3U);  // at 0.25, 0.5 and 0.75 m
  EXPECT_EQ(near[0], KeyframeId{2});
  EXPECT_EQ(near[1], KeyframeId{3});
  EXPECT_EQ(near[2], KeyframeId{1});
  EXPECT_EQ(NearbyKeyframes(world_.map, T_map_camera_, 0.38, DegreesToRadians(30.0), 2).size(), 2U);
  const Rigid3 looking_right =
      T_map_camera_ * Rigid3(ExpSo3(Eigen::Vector3d(0.0, M_PI / 2.0, 0.0)), Eigen::Vector3d::Zero());
  EXPECT_TRUE(NearbyKeyframes(world_.map, looking_right, 0.38, DegreesToRadians(30.0), 10).empty());
}

// Whether or not the grid and a first look close by leave most of the map alone.
TEST(Queries, NearbyKeyframesAreThoseOfAllThatAreNearest) {
  std::mt19937 generator(17);
  Map map = test::RandomMap(generator, 60, 4);
  std::uniform_real_distribution<double> distance(0.0, 6.0), angle(0.2, M_PI);
  for (int round = 0; round < 200; ++round) {
    map = Apply(std::move(map), {SetKeyframePose{KeyframeId{test::RandomIndex(generator, 60)},
                                                 test::RandomKeyframe(generator, 1).T_map_base}});
    const Rigid3 T_map_camera = test::RandomKeyframe(generator, 1).T_map_base;
    const double within = distance(generator), turned = angle(generator);
    std::vector<std::pair<double, KeyframeId>> all;
    for (const auto& [id, keyframe] : map.keyframes) {
      const Rigid3 T = keyframe.T_map_camera();
      const Eigen::Vector3d axis = T_map_camera.rotation * Eigen::Vector3d::UnitZ();
      const double d = (T.translation - T_map_camera.translation).norm();
      if (d <= within && axis.dot(T.rotation * Eigen::Vector3d::UnitZ()) >= std::cos(turned)) all.emplace_back(d, id);
    }
    std::sort(all.begin(), all.end());
    for (const std::size_t limit : {std::size_t{3}, map.keyframes.size()}) {
      const std::vector<KeyframeId> near = NearbyKeyframes(map, T_map_camera, within, turned, limit);
      ASSERT_EQ(near.size(), std::min(limit, all.size()));
      for (std::size_t k = 0; k < near.size(); ++k) EXPECT_EQ(near[k], all[k].second);
    }
  }
}

TEST_F(QueriesTest, VotedKeyframesSeeMostOfTheLandmarks) {
  const std::vector<LandmarkId>& of_last = world_.map.keyframes.At(KeyframeId{7}).landmarks;
  const auto votes = [&](KeyframeId keyframe) {
    const std::vector<LandmarkId> theirs = LandmarksOf(world_.map, {keyframe});
    return std::count_if(of_last.begin(), of_last.end(),
                         [&theirs](LandmarkId id) { return std::binary_search(theirs.begin(), theirs.end(), id); });
  };
  const std::vector<KeyframeId> voted = VotedKeyframes(world_.map, of_last, 5);
  ASSERT_EQ(voted.size(), 5U);
  for (std::size_t i = 1; i < voted.size(); ++i) EXPECT_GE(votes(voted[i - 1]), votes(voted[i]));
  for (const auto& [id, keyframe] : world_.map.keyframes) EXPECT_LE(votes(id), votes(voted.front()));
  EXPECT_TRUE(VotedKeyframes(world_.map, {LandmarkId{}}, 3).empty());
}

TEST_F(QueriesTest, LandmarksOfIsAnAscendingUnion) {
  const std::vector<LandmarkId> ids = LandmarksOf(world_.map, {KeyframeId{2}, KeyframeId{1}});
  EXPECT_TRUE(std::is_sorted(ids.begin(), ids.end()));
  std::set<LandmarkId> expected;
  for (const KeyframeId k : {KeyframeId{1}, KeyframeId{2}}) {
    for (const LandmarkId id : world_.map.keyframes.At(k).landmarks) {
      if (id.valid()) expected.insert(id);
    }
  }
  EXPECT_TRUE(std::equal(ids.begin(), ids.end(), expected.begin(), expected.end()));
}

TEST_F(QueriesTest, LandmarksOfSpansIdsFarApart) {
  const LandmarkId far{world_.map.next_landmark_id + 1000000};
  Landmark landmark;
  landmark.p_map = world_.true_points.front();
  MapEdit edit;
  const LandmarkId first = LandmarksOf(world_.map, {KeyframeId{1}}).front();
  edit.emplace_back(EraseLandmarks{{first}});
  const Map map = Apply(world_.map, edit);
  const std::vector<LandmarkId>& seen = map.keyframes.At(KeyframeId{1}).landmarks;
  const auto keypoint = static_cast<std::uint32_t>(
      std::find_if(seen.begin(), seen.end(), [](LandmarkId id) { return !id.valid(); }) - seen.begin());
  landmark.observations = {{KeyframeId{1}, keypoint}};
  landmark.created_by = KeyframeId{1};
  const std::vector<LandmarkId> ids = LandmarksOf(Apply(map, {AddLandmark{far, landmark}}), {KeyframeId{1}});
  EXPECT_TRUE(std::is_sorted(ids.begin(), ids.end()));
  EXPECT_EQ(ids.back(), far);
  EXPECT_EQ(ids.size(), LandmarksOf(world_.map, {KeyframeId{1}}).size());
  EXPECT_TRUE(LandmarksOf(world_.map, {}).empty());
}

TEST_F(QueriesTest, ValidOnlyKeepsTheOrder) {
  const std::vector<LandmarkId> ids{LandmarkId{7}, LandmarkId{}, LandmarkId{2}, LandmarkId{}};
  EXPECT_EQ(ValidOnly(ids), (std::vector<LandmarkId>{LandmarkId{7}, LandmarkId{2}}));
}

TEST_F(QueriesTest, WellObservedLandmarksExistAndWereSeenTwice) {
  const std::vector<LandmarkId> seen = ValidOnly(world_.map.keyframes.At(KeyframeId{3}).landmarks);
  EXPECT_EQ(CountObserved(world_.map, seen, 2), static_cast<int>(seen.size()));
  Landmark once = world_.map.landmarks.At(seen[1]);
  once.observations.resize(1);
  Map map = Apply(world_.map, {EraseLandmarks{{seen[0], seen[1]}}});
  map = Apply(std::move(map), {AddLandmark{LandmarkId{map.next_landmark_id}, once}});
  std::vector<LandmarkId> asked = seen;
  asked.push_back(std::prev(map.landmarks.end())->first);
  asked.emplace_back();
  EXPECT_EQ(CountObserved(map, asked, 2), static_cast<int>(seen.size()) - 2);
}

TEST_F(QueriesTest, MedianDepthIsThatOfTheExistingOnes) {
  std::vector<LandmarkId> seen = ValidOnly(world_.map.keyframes.At(KeyframeId{2}).landmarks);
  std::vector<double> depths;
  for (const LandmarkId id : seen) {
    depths.push_back((T_map_camera_.Inverse() * world_.map.landmarks.At(id).p_map).z());
  }
  std::sort(depths.begin(), depths.end());
  seen.emplace_back();
  seen.push_back(LandmarkId{world_.map.next_landmark_id});
  const double median = MedianDepth(world_.map, seen, T_map_camera_);
  EXPECT_GE(median, depths[(depths.size() - 1) / 2]);
  EXPECT_LE(median, depths[depths.size() / 2]);
  EXPECT_EQ(MedianDepth(world_.map, {LandmarkId{}}, T_map_camera_), 0.0);
}

}  // namespace
}  // namespace planar_vslam
