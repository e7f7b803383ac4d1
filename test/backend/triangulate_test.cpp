#include <gtest/gtest.h>

#include <cmath>
#include <variant>

#include "map_testing.h"
#include "stages.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

class TriangulateTest : public ::testing::Test {
 protected:
  TriangulateTest() {
    test::SyntheticWorldOptions options;
    options.pixel_noise = 0.3;
    options.points = 400;
    world_ = test::MakeSyntheticWorld(options);
    context_.model = world_.Context();
    EraseLandmarks erase;
    for (const auto& [id, landmark] : world_.map.landmarks) {
      if (id.value % 3 != 0) erase.ids.push_back(id);
    }
    map_ = Apply(world_.map, {erase});
  }

  const KeyframeId newest_{5};
  const std::vector<KeyframeId> neighbors_{KeyframeId{4}, KeyframeId{6}, KeyframeId{3}, KeyframeId{2}};
  test::SyntheticWorld world_;
  Map map_;
  MapperContext context_;
};

TEST_F(TriangulateTest, WithSeveralNeighborsIsWithOneAfterTheOther) {
  const MapEdit together = TriangulateWith(map_, newest_, neighbors_, context_);
  EXPECT_GT(together.size(), 50U);
  Map one_by_one = map_;
  std::size_t steps = 0;
  for (const KeyframeId neighbor : neighbors_) {
    const MapEdit edit = TriangulateWith(one_by_one, newest_, {neighbor}, context_);
    steps += edit.size();
    one_by_one = Apply(std::move(one_by_one), edit);
  }
  EXPECT_EQ(together.size(), steps);
  const Map at_once = Apply(map_, together);
  EXPECT_TRUE(Validate(at_once).empty());
  test::ExpectSameMap(at_once, one_by_one);
}

TEST_F(TriangulateTest, LandmarksHaveTheParallaxAskedFor) {
  context_.options.min_parallax = DegreesToRadians(4.0);
  const MapEdit few = TriangulateWith(map_, newest_, neighbors_, context_);
  ASSERT_FALSE(few.empty());
  for (const MapEditStep& step : few) {
    const Landmark& landmark = std::get<AddLandmark>(step).landmark;
    ASSERT_EQ(landmark.observations.size(), 2U);
    const auto ray = [&](const Observation& o) {
      return (landmark.p_map - map_.keyframes.At(o.keyframe).T_map_camera().translation).normalized();
    };
    const double cosine = ray(landmark.observations[0]).dot(ray(landmark.observations[1]));
    EXPECT_LE(cosine, std::cos(context_.options.min_parallax) + 1e-12);
  }
  context_.options.min_parallax = DegreesToRadians(0.1);
  EXPECT_GT(TriangulateWith(map_, newest_, neighbors_, context_).size(), few.size());
}

TEST_F(TriangulateTest, KeypointsThatShowALandmarkMakeNoOther) {
  for (const MapEditStep& step : TriangulateWith(map_, newest_, neighbors_, context_)) {
    for (const Observation& o : std::get<AddLandmark>(step).landmark.observations) {
      EXPECT_FALSE(map_.keyframes.At(o.keyframe).landmarks[o.keypoint].valid());
    }
  }
}

}  // namespace
}  // namespace planar_vslam
