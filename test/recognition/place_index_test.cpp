#include "planar_vslam/recognition/place_index.h"

#include <gtest/gtest.h>

#include "planar_vslam/map/map_edit.h"
#include "planar_vslam/map/queries.h"
#include "support/random_map.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

PlaceIndex IndexOf(const Map& map) {
  PlaceIndex index;
  index.Update(map);
  return index;
}

TEST(PlaceIndex, NamesTheKeyframesAroundTheView) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  const test::SyntheticView view = test::Observe(world, test::SyntheticPose(1.1) * world.T_base_camera, 0.5, 3);
  const std::vector<KeyframeId> found = IndexOf(world.map).Resembling(*view.features, 2);
  ASSERT_EQ(found.size(), 2U);
  for (const KeyframeId id : found) {
    const Rigid3& T_map_base = world.map.keyframes.At(id).T_map_base;
    EXPECT_LT((T_map_base.translation - test::SyntheticPose(1.1).translation).norm(), 0.6) << id.value;
  }
}

// Descriptors of a view are those of its landmarks: the votes are theirs.
TEST(PlaceIndex, VotesAsTheLandmarksInViewDo) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  const test::SyntheticView view = test::Observe(world, test::SyntheticPose(0.7) * world.T_base_camera, 0.5, 3);
  EXPECT_EQ(IndexOf(world.map).Resembling(*view.features, 8), VotedKeyframes(world.map, view.landmarks, 8));
}

TEST(PlaceIndex, OfSomeLandmarksKnowsNoOthers) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  const test::SyntheticView view = test::Observe(world, test::SyntheticPose(0.7) * world.T_base_camera, 0.5, 3);
  const std::vector<LandmarkId> few(view.landmarks.begin(), view.landmarks.begin() + 7);
  EXPECT_EQ(PlaceIndex(world.map, few).Resembling(*view.features, 8), VotedKeyframes(world.map, few, 8));
}

TEST(PlaceIndex, PassesOverWhatLooksLikeNothingInTheMap) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  test::SyntheticWorldOptions elsewhere;
  elsewhere.seed = 77;
  const test::SyntheticWorld other = test::MakeSyntheticWorld(elsewhere);
  const test::SyntheticView view = test::Observe(other, other.T_base_camera, 0.0, 3);
  EXPECT_TRUE(IndexOf(world.map).Resembling(*view.features, 8).empty());
}

TEST(PlaceIndex, OfNothingNamesNothing) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  EXPECT_TRUE(IndexOf(Map{}).Resembling(*world.map.keyframes.At(KeyframeId{0}).features, 2).empty());
  EXPECT_TRUE(IndexOf(world.map).Resembling(FrameFeatures{}, 2).empty());
}

class PlaceIndexEdits : public testing::TestWithParam<unsigned> {};

TEST_P(PlaceIndexEdits, UpdatedIsWhatItWouldBeNewlyMade) {
  std::mt19937 generator(GetParam());
  Map map = test::RandomMap(generator, 6, 20);
  PlaceIndex index;
  constexpr int kEdits = 40, kStepsAnEdit = 8;
  constexpr std::size_t kKeypoints = 15;
  for (int i = 0; i < kEdits; ++i) {
    map = Apply(std::move(map), test::RandomEditor(generator, map).Write(kStepsAnEdit));
    if (generator() % 3 == 0) continue;  // not every map is seen
    index.Update(map);
    const PlaceIndex rebuilt = IndexOf(map);
    ASSERT_TRUE(index == rebuilt) << "after edit " << i;
    const FrameFeaturesPtr image = test::RandomFeatures(generator, kKeypoints);
    ASSERT_EQ(index.Resembling(*image, 4), rebuilt.Resembling(*image, 4)) << "after edit " << i;
  }
}

TEST_P(PlaceIndexEdits, AnotherMapTakesThePlaceOfTheFirst) {
  std::mt19937 generator(GetParam());
  const auto random_map = [&generator](std::size_t landmarks) {
    Map map = test::RandomMap(generator, 6, landmarks);
    for (int i = 0; i < 5; ++i) map = Apply(std::move(map), test::RandomEditor(generator, map).Write(8));
    return map;
  };
  PlaceIndex index;
  for (const std::size_t landmarks : {20U, 30U, 10U}) {
    const Map map = random_map(landmarks);
    index.Update(map);
    EXPECT_TRUE(index == IndexOf(map));
  }
  index.Update(Map{});
  EXPECT_TRUE(index == PlaceIndex{});
}

INSTANTIATE_TEST_SUITE_P(Seeds, PlaceIndexEdits, testing::Values(1U, 2U, 3U, 4U, 5U, 6U));

}  // namespace
}  // namespace planar_vslam
