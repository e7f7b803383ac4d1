#include <gtest/gtest.h>

#include "support/random_map.h"

namespace planar_vslam::test {
namespace {

int SharedLandmarks(const Map& map, KeyframeId a, KeyframeId b) {
  int shared = 0;
  for (const auto& [id, landmark] : map.landmarks) {
    bool in_a = false, in_b = false;
    for (const Observation& o : landmark.observations) {
      in_a |= o.keyframe == a;
      in_b |= o.keyframe == b;
    }
    shared += in_a && in_b ? 1 : 0;
  }
  return shared;
}

TEST(Covisibility, CountsSharedLandmarksInOrder) {
  std::mt19937 generator(3);
  const Map map = RandomMap(generator, 9, 40);
  for (const auto& [id, keyframe] : map.keyframes) {
    for (const int min_shared : {1, 5, 15}) {
      const auto covisible = CovisibleKeyframes(map, id, min_shared);
      std::size_t expected = 0;
      for (const auto& [other, unused] : map.keyframes) {
        if (other != id && SharedLandmarks(map, id, other) >= min_shared) ++expected;
      }
      EXPECT_EQ(covisible.size(), expected);
      for (std::size_t i = 0; i < covisible.size(); ++i) {
        EXPECT_EQ(covisible[i].shared, SharedLandmarks(map, id, covisible[i].id));
        if (i == 0) continue;
        const auto &a = covisible[i - 1], &b = covisible[i];
        EXPECT_TRUE(a.shared > b.shared || (a.shared == b.shared && a.id < b.id));
      }
    }
  }
}

TEST(Covisibility, AKeyframeThatIsGoneHasNone) { EXPECT_TRUE(CovisibleKeyframes(Map{}, K(3), 1).empty()); }

}  // namespace
}  // namespace planar_vslam::test
