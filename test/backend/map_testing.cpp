#include "map_testing.h"

#include <gtest/gtest.h>

namespace planar_vslam::test {
namespace {

constexpr double kRounding = 1e-9;

std::vector<KeyframeId> LinksOf(const Keyframe& keyframe) {
  std::vector<KeyframeId> from;
  if (keyframe.odometry_link.has_value()) from.push_back(keyframe.odometry_link->from);
  for (const MotionLink& link : keyframe.laser_links) from.push_back(link.from);
  return from;
}

void ExpectSameLandmark(LandmarkId id, const Landmark& a, const Landmark& b) {
  EXPECT_LT((a.p_map - b.p_map).norm(), kRounding) << id.value;
  EXPECT_LT((a.view_direction - b.view_direction).norm(), kRounding) << id.value;
  EXPECT_EQ(a.descriptor, b.descriptor) << id.value;
  EXPECT_EQ(a.found, b.found) << id.value;
  ASSERT_EQ(a.observations.size(), b.observations.size()) << id.value;
  for (std::size_t i = 0; i < a.observations.size(); ++i) {
    EXPECT_EQ(a.observations[i].keyframe, b.observations[i].keyframe) << id.value;
    EXPECT_EQ(a.observations[i].keypoint, b.observations[i].keypoint) << id.value;
  }
}

}  // namespace

void ExpectSameMap(const Map& a, const Map& b) {
  ASSERT_EQ(a.keyframes.size(), b.keyframes.size());
  for (const auto& [id, keyframe] : a.keyframes) {
    const Keyframe* other = b.keyframes.Find(id);
    ASSERT_NE(other, nullptr) << id.value;
    EXPECT_LT(LogSe3(keyframe.T_map_base.Inverse() * other->T_map_base).norm(), kRounding) << id.value;
    EXPECT_EQ(keyframe.landmarks, other->landmarks) << id.value;
    EXPECT_EQ(LinksOf(keyframe), LinksOf(*other)) << id.value;
  }
  ASSERT_EQ(a.landmarks.size(), b.landmarks.size());
  for (const auto& [id, landmark] : a.landmarks) {
    const Landmark* other = b.landmarks.Find(id);
    ASSERT_NE(other, nullptr) << id.value;
    ExpectSameLandmark(id, landmark, *other);
  }
}

}  // namespace planar_vslam::test
