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

TEST(IdMap, WhatIsWrittenToOneCopyDoesNotShowInAnother) {
  std::mt19937 generator(4);
  IdMap<LandmarkId, int> ids;
  std::vector<std::pair<IdMap<LandmarkId, int>, std::map<LandmarkId, int>>> copies(1);
  for (int round = 0; round < 400; ++round) {
    auto [now, reference] = copies[RandomIndex(generator, copies.size())];
    const LandmarkId id = L(RandomIndex(generator, 6) * 1000 + RandomIndex(generator, 70));
    if (!now.Contains(id)) {
      now.Insert(id, round);
      reference.emplace(id, round);
    } else if (round % 3 == 0) {
      now.Erase({id});
      reference.erase(id);
    } else {
      now.Edit(id) = reference[id] = round;
    }
    if (copies.size() < 8) {
      copies.emplace_back(now, reference);
    } else {
      copies[RandomIndex(generator, copies.size())] = {now, reference};
    }
    for (const auto& [copy, expected] : copies) {
      ASSERT_EQ(copy.size(), expected.size());
      ASSERT_TRUE(std::equal(copy.begin(), copy.end(), expected.begin(), expected.end(),
                             [](const auto& a, const auto& b) { return a.first == b.first && a.second == b.second; }));
    }
  }
}

TEST(IdMap, GoesThroughFromAnyIdAndBackwards) {
  IdMap<LandmarkId, int> ids;
  for (const std::uint32_t value : {3U, 31U, 32U, 2047U, 2048U, 9000U}) ids.Insert(L(value), 0);
  EXPECT_EQ(ids.From(L(0))->first, L(3));
  EXPECT_EQ(ids.From(L(33))->first, L(2047));
  EXPECT_EQ(ids.From(L(9001)), ids.end());
  std::vector<LandmarkId> backwards;
  for (auto it = ids.end(); it != ids.begin();) backwards.push_back((--it)->first);
  std::vector<LandmarkId> forwards = ids.Ids();
  EXPECT_TRUE(std::equal(forwards.begin(), forwards.end(), backwards.rbegin(), backwards.rend()));
}

TEST(IdMap, VisitsWhatTwoCopiesDoNotShare) {
  IdMap<LandmarkId, int> before;
  for (std::uint32_t value = 0; value < 5000; value += 7) before.Insert(L(value), 1);
  IdMap<LandmarkId, int> now = before;
  now.Edit(L(70)) = 2;
  now.Erase({L(700)});
  now.Insert(L(9000), 3);
  std::vector<std::pair<std::uint32_t, int>> seen;
  now.VisitChanges(before, [&seen](LandmarkId id, const int* was, const int* is) {
    seen.emplace_back(id.value, 10 * (was != nullptr ? *was : 0) + (is != nullptr ? *is : 0));
  });
  EXPECT_EQ(seen, (std::vector<std::pair<std::uint32_t, int>>{{70, 12}, {700, 10}, {9000, 3}}));
  now.VisitChanges(now, [](LandmarkId, const int*, const int*) { FAIL(); });
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
