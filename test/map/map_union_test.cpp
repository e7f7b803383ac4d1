#include "planar_vslam/map/map_union.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/random_map.h"

namespace planar_vslam::test {
namespace {

auto LandmarksSeen(const Keyframe& keyframe) {
  return std::count_if(keyframe.landmarks.begin(), keyframe.landmarks.end(), [](LandmarkId id) { return id.valid(); });
}

TEST(MapUnion, HoldsBothMapsAsTheyWere) {
  std::mt19937 generator(5);
  for (int round = 0; round < 20; ++round) {
    Map a = RandomMap(generator, 8, 12);
    Map b = RandomMap(generator, 6, 12);
    RandomEditor editor(generator, b);  // gaps among its ids, laser links, sweeps
    b = Apply(std::move(b), editor.Write(30));
    a.metric = b.metric;
    const Map raised = RenumberedAbove(a, b);
    EXPECT_EQ(Validate(raised), std::vector<std::string>{});
    EXPECT_EQ(raised.next_keyframe_id, a.next_keyframe_id + b.next_keyframe_id);
    Map both = UnionOf(a, raised);
    EXPECT_EQ(Validate(both), std::vector<std::string>{});
    EXPECT_EQ(both.keyframes.size(), a.keyframes.size() + b.keyframes.size());
    EXPECT_EQ(both.landmarks.size(), a.landmarks.size() + b.landmarks.size());
    for (const auto& [id, keyframe] : b.keyframes) {
      const Keyframe& now = both.keyframes.At({id.value + a.next_keyframe_id});
      EXPECT_EQ(now.sweeps.size(), keyframe.sweeps.size());
      EXPECT_EQ(now.laser_links.size(), keyframe.laser_links.size());
      EXPECT_EQ(now.odometry_link.has_value(), keyframe.odometry_link.has_value());
      EXPECT_EQ(LandmarksSeen(now), LandmarksSeen(keyframe));
    }
  }
}

TEST(MapUnion, AboveNothingAMapStaysAsItIs) {
  std::mt19937 generator(6);
  const Map map = RandomMap(generator, 8, 12);
  EXPECT_TRUE(Equal(RenumberedAbove(Map{}, map), map));
}

}  // namespace
}  // namespace planar_vslam::test
