#include "planar_vslam/backend/loop_closing.h"

#include <gtest/gtest.h>

#include "loop_testing.h"

namespace planar_vslam {
namespace {

using test::Driver;
using test::kDrift;
using test::kKidnapped;
using test::kSystematic;
using test::LoopTest;

TEST_F(LoopTest, FindsTheOldPlaceAndWhereItIs) {
  const Driver driver = ComeBack(kDrift);
  const std::optional<Loop> loop = Find(driver);
  ASSERT_TRUE(loop.has_value());
  EXPECT_LT(loop->old.value, 8u);
  ASSERT_EQ(loop->views.size(), static_cast<std::size_t>(kViews));
  for (int k = 0; k < kViews; ++k) {
    const LoopView& view = loop->views[static_cast<std::size_t>(k)];
    EXPECT_EQ(view.keyframe.value, driver.newest().value - static_cast<std::uint32_t>(k));
    EXPECT_LT(Distance(view.T_map_base, TrueView(kViews - 1 - k)), 0.02);
    EXPECT_GT(view.matches.count, 30);
  }
}

TEST_F(LoopTest, ClosingItBringsTheKeyframesHomeAndMakesTwoLandmarksOne) {
  const Driver driver = ComeBack(kDrift);
  const Expected<BentMap> bent =
      CloseLoop(driver.map(), *Find(driver), TiesOf(driver.map(), context_), context_.planar);
  ASSERT_TRUE(bent.ok()) << bent.error().message;
  const Map* closed = &bent->map;
  EXPECT_EQ(Validate(*closed), std::vector<std::string>{});
  for (int k = 0; k < kViews; ++k) {
    const KeyframeId id{driver.newest().value - static_cast<std::uint32_t>(k)};
    EXPECT_LT(Distance(closed->keyframes.At(id).T_map_base, TrueView(kViews - 1 - k)), 0.03);
  }
  EXPECT_LT(closed->landmarks.size(), driver.map().landmarks.size() - 50);
  for (const auto& [id, keyframe] : world_.map.keyframes) {  // seen well: the old place stays where it is
    EXPECT_LT(Distance(closed->keyframes.At(id).T_map_base, keyframe.T_map_base), 0.01) << id.value;
  }
}

TEST_F(LoopTest, NothingIsFoundWhereTheMapCannotBeThatFarOff) {
  EXPECT_FALSE(Find(ComeBack(Embed3(Rigid2(2.5, 0.0, 0.3)))).has_value());
  const Driver driver = ComeBack(Embed3(Rigid2(0.3, -0.2, 0.03)));
  EXPECT_TRUE(Find(driver).has_value());
  LoopOptions trusting;
  trusting.sigma_factor = 0.1;
  EXPECT_FALSE(Find(driver, trusting).has_value());
}

TEST_F(LoopTest, NothingIsFoundWhereTooFewLandmarksAreSeen) {
  const Driver driver = ComeBack(kDrift);
  const int seen = Find(driver)->views.front().matches.count;
  LoopOptions strict;
  strict.min_inliers = seen;
  EXPECT_TRUE(Find(driver, strict).has_value());
  strict.min_inliers = seen + 1;
  EXPECT_FALSE(Find(driver, strict).has_value());
}

TEST_F(LoopTest, APlaceThatShowsLittleOfWhatShouldBeInViewOnlyLooksAlike) {
  EXPECT_TRUE(Find(ComeBack(kDrift, 0.8)).has_value());
  EXPECT_FALSE(Find(ComeBack(kDrift, 0.2)).has_value());
}

TEST_F(LoopTest, NothingIsFoundWhenSwitchedOff) {
  LoopOptions off;
  off.enabled = false;
  EXPECT_FALSE(Find(ComeBack(kDrift), off).has_value());
}

TEST_F(LoopTest, OneViewAloneIsNotBelieved) {
  // The last view is the same both times; those before it see all of the place, or next to nothing.
  const auto is_found = [this](double share_before) {
    Driver driver(world_);
    for (int k = 0; k < 16; ++k) driver.Drive(Rigid2(k < 8 ? 0.5 : -0.5, 0.0, 0.0), Blank());
    for (int k = 0; k + 1 < kViews; ++k) driver.Stand(kDrift * TrueView(k), TrueView(k), share_before);
    driver.Stand(kDrift * TrueView(kViews - 1), TrueView(kViews - 1), 1.0);
    return Find(driver).has_value();
  };
  EXPECT_TRUE(is_found(1.0));
  EXPECT_FALSE(is_found(0.01));
}

TEST_F(LoopTest, APlaceThatIsJoinedAlreadyIsNoLoop) {
  const Driver driver = ComeBack(kDrift);
  const Expected<BentMap> bent =
      CloseLoop(driver.map(), *Find(driver), TiesOf(driver.map(), context_), context_.planar);
  ASSERT_TRUE(bent.ok()) << bent.error().message;
  const Map* closed = &bent->map;
  MapDrift drift(context_, kSystematic);
  drift.Follow(*closed);
  EXPECT_FALSE(FindLoop(*closed, driver.newest(), drift, context_, {}).has_value());
}

TEST_F(LoopTest, AKidnappedRobotFindsHomeAndItsWheelsAreNotBelieved) {
  KeyframeId kidnapped;
  const Driver driver = ComeBackKidnapped(kKidnapped, &kidnapped);
  const std::optional<Loop> loop = Find(driver);
  ASSERT_TRUE(loop.has_value());
  const Expected<BentMap> bent = CloseLoop(driver.map(), *loop, TiesOf(driver.map(), context_), context_.planar);
  ASSERT_TRUE(bent.ok()) << bent.error().message;
  const Map* closed = &bent->map;
  EXPECT_LT(Distance(closed->keyframes.At(driver.newest()).T_map_base, TrueView(kViews - 1)), 0.03);
  EXPECT_FALSE(closed->keyframes.At(kidnapped).odometry_link.has_value());
  for (auto it = std::next(driver.map().keyframes.begin()); it != driver.map().keyframes.end(); ++it) {
    EXPECT_EQ(closed->keyframes.At(it->first).odometry_link.has_value(), it->first != kidnapped) << it->first.value;
  }
  // What came after the carrying moved as one piece.
  const Rigid3 T_before = driver.map().keyframes.At(kidnapped).T_map_base.Inverse() *
                          driver.map().keyframes.At(KeyframeId{kidnapped.value + 8}).T_map_base;
  const Rigid3 T_after = closed->keyframes.At(kidnapped).T_map_base.Inverse() *
                         closed->keyframes.At(KeyframeId{kidnapped.value + 8}).T_map_base;
  EXPECT_LT(Distance(T_before, T_after), 0.01);
}

TEST(LoopOptions, NameWhatIsWrong) {
  EXPECT_TRUE(LoopOptions{}.Problems().empty());
  LoopOptions options;
  options.min_inliers = 3;
  options.min_share = 1.5;
  options.sigma_factor = 0.0;
  EXPECT_EQ(options.Problems().size(), 3u);
}

}  // namespace
}  // namespace planar_vslam
