#include "planar_vslam/map/distance_driven.h"

#include <gtest/gtest.h>

#include "planar_vslam/map/map_edit.h"

namespace planar_vslam {
namespace {

// Keyframes a metre apart, each with room for four landmarks.
Map Road(std::uint32_t keyframes) {
  Map map;
  map.octave_scales = {1.0};
  auto features = std::make_shared<FrameFeatures>();
  features->keypoints.resize(4);
  features->descriptors.resize(4);
  for (std::uint32_t k = 0; k < keyframes; ++k) {
    Keyframe keyframe;
    keyframe.T_map_base = Embed3(Rigid2(k, 0.0, 0.0));
    keyframe.features = features;
    keyframe.landmarks.resize(4);
    map = Apply(std::move(map), {AddKeyframe{KeyframeId{k}, std::move(keyframe)}});
  }
  return map;
}

void AddSeenBy(const std::vector<std::uint32_t>& keyframes, std::uint32_t keypoint, Map* map) {
  Landmark landmark;
  for (const std::uint32_t k : keyframes) landmark.observations.push_back({KeyframeId{k}, keypoint});
  landmark.created_by = landmark.observations.front().keyframe;
  *map = Apply(std::move(*map), {AddLandmark{LandmarkId{map->next_landmark_id}, landmark}});
}

TEST(DistanceDriven, IsDrivenFromKeyframeToKeyframe) {
  const Map map = Road(9);
  const DistanceDriven way(map);
  EXPECT_DOUBLE_EQ(way.Between(KeyframeId{0}, KeyframeId{8}), 8.0);
  EXPECT_DOUBLE_EQ(way.Between(KeyframeId{3}, KeyframeId{5}), 2.0);
}

TEST(DistanceDriven, ALandmarkIsOldWhenNoneOfTheLastMetresSawIt) {
  Map map = Road(9);
  AddSeenBy({0, 1, 2}, 0, &map);
  AddSeenBy({1, 5}, 1, &map);
  const DistanceDriven way(map);
  EXPECT_TRUE(way.IsOld(map.landmarks.At(LandmarkId{0}), KeyframeId{8}));
  EXPECT_FALSE(way.IsOld(map.landmarks.At(LandmarkId{1}), KeyframeId{8}));
}

TEST(DistanceDriven, AKeyframeHasReturnedWhenMostOfWhatItSeesWasSeenLongBefore) {
  Map map = Road(9);
  AddSeenBy({0, 1, 8}, 0, &map);                    // a return
  AddSeenBy({0, 1, 2, 3, 4, 5, 6, 7, 8}, 1, &map);  // seen all the while
  EXPECT_FALSE(DistanceDriven(map).HasReturned(map, map.keyframes.At(KeyframeId{8})));
  AddSeenBy({1, 2, 8}, 2, &map);
  EXPECT_TRUE(DistanceDriven(map).HasReturned(map, map.keyframes.At(KeyframeId{8})));
  EXPECT_FALSE(DistanceDriven(map).HasReturned(map, map.keyframes.At(KeyframeId{5})));
}

}  // namespace
}  // namespace planar_vslam
