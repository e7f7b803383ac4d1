// Which part of the map the local bundle adjustment takes: free keyframes, landmarks, the border that is held fixed.
#include <gtest/gtest.h>

#include <algorithm>

#include "planar_vslam/map/queries.h"
#include "stages.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

bool Holds(const std::vector<KeyframeId>& ids, KeyframeId id) { return std::binary_search(ids.begin(), ids.end(), id); }

class LocalRequestTest : public ::testing::Test {
 protected:
  LocalRequestTest() {
    test::SyntheticWorldOptions options;
    options.keyframes = 20;
    options.points = 700;
    map_ = test::MakeSyntheticWorld(options).map;
    options_.young_map = 0;
    options_.window = 3;
    options_.wide_window = 6;
    options_.wide_every = 1000;  // the map has fewer keyframes
    options_.link_neighbors = 1;
  }
  KeyframeId newest() const { return std::prev(map_.keyframes.end())->first; }
  BundleRequest Request() const { return LocalRequest(map_, newest(), options_); }
  // Of the landmarks that take part, how many each keyframe sees.
  int Seen(const BundleRequest& request, KeyframeId id) const {
    const std::vector<LandmarkId>& landmarks = map_.keyframes.At(id).landmarks;
    return static_cast<int>(std::count_if(landmarks.begin(), landmarks.end(), [&](LandmarkId l) {
      return std::binary_search(request.landmarks.begin(), request.landmarks.end(), l);
    }));
  }
  // Nothing ties the first `count` keyframes to the others any more.
  void CutOff(std::uint32_t count) {
    MapEdit edit{EraseOdometryLink{KeyframeId{count}}};
    for (const auto& [id, landmark] : map_.landmarks) {
      for (const Observation& o : landmark.observations) {
        if (o.keyframe.value < count) edit.emplace_back(EraseObservation{id, o.keyframe});
      }
    }
    map_ = Apply(std::move(map_), edit);
  }

  Map map_;
  MapperOptions options_;
};

TEST_F(LocalRequestTest, TakesAYoungMapAsAWhole) {
  options_.young_map = static_cast<int>(map_.keyframes.size());
  const BundleRequest request = Request(), whole = WholeMapRequest(map_);
  EXPECT_EQ(request.free_keyframes, whole.free_keyframes);
  EXPECT_EQ(request.fixed_keyframes, whole.fixed_keyframes);
  EXPECT_EQ(request.landmarks, whole.landmarks);
}

TEST_F(LocalRequestTest, FreesTheNewestAndItsNeighboursAndTakesAllTheySee) {
  const BundleRequest request = Request();
  EXPECT_TRUE(Holds(request.free_keyframes, newest()));
  EXPECT_TRUE(Holds(request.free_keyframes, map_.keyframes.At(newest()).odometry_link->from));
  EXPECT_LE(request.free_keyframes.size(), 5u) << "the newest, three that see the same, one by its link";
  EXPECT_GE(request.free_keyframes.size(), 4u);
  std::vector<LandmarkId> seen;
  for (const KeyframeId id : request.free_keyframes) {
    const std::vector<LandmarkId> of_one = ValidOnly(map_.keyframes.At(id).landmarks);
    seen.insert(seen.end(), of_one.begin(), of_one.end());
  }
  std::sort(seen.begin(), seen.end());
  seen.erase(std::unique(seen.begin(), seen.end()), seen.end());
  EXPECT_EQ(request.landmarks, seen);
}

TEST_F(LocalRequestTest, EveryWideEveryKeyframeTheWindowIsWide) {
  const std::size_t narrow = Request().free_keyframes.size();
  options_.wide_every = static_cast<int>(newest().value);
  const std::size_t wide = Request().free_keyframes.size();
  EXPECT_EQ(wide, narrow + 3);
}

TEST_F(LocalRequestTest, HoldsAllOthersThatSeeTheseLandmarks) {
  const BundleRequest request = Request();
  EXPECT_TRUE(std::is_sorted(request.fixed_keyframes.begin(), request.fixed_keyframes.end()));
  for (const auto& [id, keyframe] : map_.keyframes) {
    const bool free = Holds(request.free_keyframes, id);
    EXPECT_EQ(Holds(request.fixed_keyframes, id), !free && Seen(request, id) > 0) << id.value;
  }
}

TEST_F(LocalRequestTest, HoldsAtMostSoManyAndThenThoseThatSeeMost) {
  const BundleRequest all = Request();
  ASSERT_GT(all.fixed_keyframes.size(), 3u);
  options_.max_fixed = 3;
  const BundleRequest few = Request();
  ASSERT_EQ(few.fixed_keyframes.size(), 3u);
  int least_kept = 1 << 20;
  const KeyframeId linked = map_.keyframes.At(few.free_keyframes.front()).odometry_link->from;
  for (const KeyframeId id : few.fixed_keyframes) {
    if (id != linked) least_kept = std::min(least_kept, Seen(all, id));
  }
  for (const KeyframeId id : all.fixed_keyframes) {
    if (!Holds(few.fixed_keyframes, id)) {
      EXPECT_LE(Seen(all, id), least_kept) << id.value;
    }
  }
}

TEST_F(LocalRequestTest, FarEndsOfLinksAreInTheBorderBeforeAllOthers) {
  options_.max_fixed = 2;
  const KeyframeId far{1};
  const BundleRequest without = Request();
  ASSERT_FALSE(Holds(without.fixed_keyframes, far));
  map_ = Apply(std::move(map_), {AddLaserLinks{newest(), {{far, PlanarMotion{}}}}});
  const BundleRequest with = Request();
  EXPECT_TRUE(Holds(with.fixed_keyframes, far));
  EXPECT_EQ(with.fixed_keyframes.size(), 2u);
}

TEST_F(LocalRequestTest, TheFirstKeyframeOfTheMapIsNeverFree) {
  options_.window = static_cast<int>(map_.keyframes.size());
  options_.wide_window = options_.window;
  options_.min_shared = 1;
  options_.link_neighbors = static_cast<int>(map_.keyframes.size());
  const BundleRequest request = Request();
  EXPECT_EQ(request.free_keyframes.size(), map_.keyframes.size() - 1);
  EXPECT_EQ(request.fixed_keyframes, std::vector<KeyframeId>{map_.keyframes.begin()->first});
}

TEST_F(LocalRequestTest, WithoutABorderTheOldestOfTheWindowIsHeld) {
  constexpr std::uint32_t kCut = 12;
  CutOff(kCut);
  options_.window = static_cast<int>(map_.keyframes.size());
  options_.wide_window = options_.window;
  options_.min_shared = 1;
  options_.link_neighbors = static_cast<int>(map_.keyframes.size());
  const BundleRequest request = Request();
  EXPECT_EQ(request.fixed_keyframes, std::vector<KeyframeId>{KeyframeId{kCut}});
  EXPECT_EQ(request.free_keyframes.size(), map_.keyframes.size() - kCut - 1);
}

}  // namespace
}  // namespace planar_vslam
