#include <gtest/gtest.h>

#include <map>

#include "support/random_map.h"

namespace planar_vslam::test {
namespace {

TEST(IdMap, BehavesLikeAnOrderedMap) {
  std::mt19937 generator(9);
  IdMap<LandmarkId, int> ids;
  std::map<LandmarkId, int> reference;
  for (int round = 0; round < 200; ++round) {
    const LandmarkId id = L(RandomIndex(generator, 100));
    if (!ids.Contains(id)) {
      ids.Insert(id, round);
      reference.emplace(id, round);
    }
    if (round % 10 == 0) {
      const std::vector<LandmarkId> gone = {L(RandomIndex(generator, 50)), L(50 + RandomIndex(generator, 50))};
      ids.Erase(gone);
      for (const LandmarkId g : gone) reference.erase(g);
    }
    ASSERT_TRUE(std::equal(ids.begin(), ids.end(), reference.begin(), reference.end(),
                           [](const auto& a, const auto& b) { return a.first == b.first && a.second == b.second; }));
  }
}

TEST(IdMap, FindsNothingForAnIdThatIsNotThere) {
  IdMap<KeyframeId, int> ids;
  EXPECT_EQ(ids.Find(K(0)), nullptr);
  ids.Insert(K(2), 7);
  EXPECT_EQ(ids.Find(K(1)), nullptr);
  EXPECT_EQ(ids.Find(K(3)), nullptr);
  EXPECT_EQ(ids.Find(KeyframeId{}), nullptr);
  EXPECT_EQ(ids.At(K(2)), 7);
}

TEST(IdMapDeathTest, StopsOnAnIdInsertedTwiceOrAskedForInVain) {
  IdMap<KeyframeId, int> ids;
  ids.Insert(K(2), 7);
  EXPECT_DEATH(ids.Insert(K(2), 8), "inserted twice");
  EXPECT_DEATH(ids.At(K(1)), "id=1");
}

}  // namespace
}  // namespace planar_vslam::test
