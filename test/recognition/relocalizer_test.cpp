#include "planar_vslam/recognition/relocalizer.h"

#include <gtest/gtest.h>

#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

constexpr KeyframeId kKeyframe{4};

TEST(RelocalizeAgainst, FindsThePoseWithoutAnyPrior) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  const Rigid3 T_map_camera = test::SyntheticPose(1.1) * world.T_base_camera;
  const test::SyntheticView view = test::Observe(world, T_map_camera, 0.5, 3);
  const auto hypothesis = RelocalizeAgainst(world.map, kKeyframe, *view.features, world.camera);
  ASSERT_TRUE(hypothesis.has_value());
  const Vector6d error = LogSe3(T_map_camera.Inverse() * hypothesis->T_map_camera);
  EXPECT_LT(error.head<3>().norm(), 0.05);
  EXPECT_LT(error.tail<3>().norm(), 0.02);
  int count = 0;
  ASSERT_EQ(hypothesis->matches.landmarks.size(), view.landmarks.size());
  for (std::size_t i = 0; i < view.landmarks.size(); ++i) {
    if (!hypothesis->matches.landmarks[i].valid()) continue;
    ++count;
    EXPECT_EQ(hypothesis->matches.landmarks[i], view.landmarks[i]);
  }
  EXPECT_EQ(hypothesis->matches.count, count);
}

TEST(RelocalizeAgainst, SurvivesAFifthOfWrongMatches) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  const Rigid3 T_map_camera = test::SyntheticPose(1.1) * world.T_base_camera;
  const test::SyntheticView view = test::Observe(world, T_map_camera, 0.3, 3);
  FrameFeatures features = *view.features;
  for (std::size_t i = 5; i < features.descriptors.size(); i += 5)
    std::swap(features.descriptors[i], features.descriptors[i - 5]);
  const auto hypothesis = RelocalizeAgainst(world.map, kKeyframe, features, world.camera);
  ASSERT_TRUE(hypothesis.has_value());
  EXPECT_LT(LogSe3(T_map_camera.Inverse() * hypothesis->T_map_camera).norm(), 0.06);
}

TEST(RelocalizeAgainst, SaysNothingWhereMatchesAgreeOnNoPose) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  const test::SyntheticView view = test::Observe(world, test::SyntheticPose(1.1) * world.T_base_camera, 0.0, 3);
  FrameFeatures features = *view.features;
  std::mt19937 generator(4);
  std::shuffle(features.descriptors.begin(), features.descriptors.end(), generator);
  EXPECT_FALSE(RelocalizeAgainst(world.map, kKeyframe, features, world.camera).has_value());
}

TEST(RelocalizeAgainst, SaysNothingWithFewMatches) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  const test::SyntheticView view = test::Observe(world, test::SyntheticPose(1.1) * world.T_base_camera, 0.0, 3);
  FrameFeatures features = *view.features;
  features.keypoints.resize(8);
  features.descriptors.resize(8);
  features.grid = ImageGrid(features.keypoints);
  EXPECT_FALSE(RelocalizeAgainst(world.map, kKeyframe, features, world.camera).has_value());
  EXPECT_FALSE(RelocalizeAgainst(world.map, kKeyframe, FrameFeatures{}, world.camera).has_value());
}

}  // namespace
}  // namespace planar_vslam
