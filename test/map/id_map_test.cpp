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

TEST(IdMap, KnowsPositionsInTheOrderOfIds) {
  IdMap<KeyframeId, int> ids;
  EXPECT_EQ(ids.IndexOf(K(0)), 0u);
  EXPECT_EQ(ids.Before(K(5)), nullptr);
  for (const std::uint32_t value : {7U, 2U, 4U}) ids.Insert(K(value), 10 * static_cast<int>(value));
  std::size_t index = 0;
  for (const auto& [id, value] : ids) {
    EXPECT_EQ(ids.IndexOf(id), index);
    EXPECT_EQ(ids.EntryAt(index).first, id);
    EXPECT_EQ(ids.EntryAt(index).second, value);
    const auto* before = ids.Before(id);
    EXPECT_EQ(before, index > 0 ? &ids.EntryAt(index - 1) : nullptr);
    ++index;
  }
  EXPECT_EQ(ids.IndexOf(K(3)), ids.size());
  EXPECT_EQ(ids.IndexOf(K(9)), ids.size());
  EXPECT_EQ(ids.Before(K(6))->first, K(4));
  EXPECT_EQ(ids.Before(K(9))->first, K(7));
}

TEST(IdMapDeathTest, StopsOnAnIdInsertedTwiceOrAskedForInVain) {
  IdMap<KeyframeId, int> ids;
  ids.Insert(K(2), 7);
  EXPECT_DEATH(ids.Insert(K(2), 8), "inserted twice");
  EXPECT_DEATH(ids.At(K(1)), "id=1");
  EXPECT_DEATH(ids.EntryAt(1), "index=1 of 1");
}

}  // namespace
}  // namespace planar_vslam::test
