#include "planar_vslam/backend/merge_maps.h"

#include "merge_testing.h"

namespace planar_vslam {
namespace {

using test::MergeTest;

const Rigid3 kElsewhere = Embed3(Rigid2(-3.0, 7.0, 2.2));

TEST_F(MergeTest, TwoMapsBecomeOneInTheFrameOfTheFirst) {
  const Map known = MapOf(Poses(0.0, 9)), other = MapOf(Poses(1.1, 10), kElsewhere, 70);
  const Expected<MergedMap> merged = Merge(known, other);
  ASSERT_TRUE(merged.ok()) << merged.error().message;
  EXPECT_EQ(Validate(merged->map), std::vector<std::string>{});
  EXPECT_LT(LogSe3(merged->overlap.alignment.T_known_other * kElsewhere).norm(), 0.03);
  EXPECT_GE(merged->overlap.alignment.apart, 3);
  EXPECT_EQ(merged->map.keyframes.size(), known.keyframes.size() + other.keyframes.size());
  EXPECT_GT(merged->landmarks_shared, 200);
  EXPECT_LT(merged->map.landmarks.size() + 200, known.landmarks.size() + other.landmarks.size());
  const std::vector<Rigid3> first = Poses(0.0, 9), second = Poses(1.1, 10);
  for (const auto& [id, keyframe] : merged->map.keyframes) {
    const bool is_known = id < merged->first_other;
    const Rigid3& truth = is_known ? first[id.value] : second[id.value - merged->first_other.value];
    EXPECT_LT(Distance(keyframe.T_map_base, truth), 0.02) << id.value;
    const bool begins = id.value == 0 || id == merged->first_other;
    ASSERT_EQ(keyframe.odometry_link.has_value(), !begins) << id.value;
    if (!begins) {
      EXPECT_EQ(keyframe.odometry_link->from.value, id.value - 1);
    }
  }
}

TEST_F(MergeTest, WhatOneMapHasDriftedIsSpread) {
  Map other = MapOf(Poses(0.6, 12), kElsewhere, 70);
  MapEdit drift;  // half a degree and a centimetre a keyframe
  Rigid3 off;
  for (const auto& [id, keyframe] : other.keyframes) {
    drift.emplace_back(SetKeyframePose{id, keyframe.T_map_base * off});
    off = off * Embed3(Rigid2(0.0, 0.01, DegreesToRadians(0.1)));
  }
  other = Apply(std::move(other), drift);
  const Expected<MergedMap> merged = Merge(MapOf(Poses(0.0, 14)), other);
  ASSERT_TRUE(merged.ok()) << merged.error().message;
  const std::vector<Rigid3> truth = Poses(0.6, 12);
  for (auto it = merged->map.keyframes.From(merged->first_other); it != merged->map.keyframes.end(); ++it) {
    EXPECT_LT(Distance(it->second.T_map_base, truth[it->first.value - merged->first_other.value]), 0.03);
  }
}

TEST_F(MergeTest, MapsThatDoNotOverlapStayTwo) {
  test::SyntheticWorldOptions elsewhere;
  elsewhere.points = 600;
  elsewhere.seed = 9;
  const Expected<MergedMap> merged = Merge(MapOf(Poses(0.0, 9)), test::MakeSyntheticWorld(elsewhere).map);
  ASSERT_FALSE(merged.ok());
  EXPECT_NE(merged.error().message.find("0 places"), std::string::npos) << merged.error().message;
}

TEST_F(MergeTest, OneSpotIsTooLittle) {
  const Rigid3 spot = test::SyntheticPose(1.0);
  const std::vector<Rigid3> stands = {spot, spot * Embed3(Rigid2(0.1, 0.0, 0.0)), spot * Embed3(Rigid2(0.2, 0.0, 0.0))};
  EXPECT_FALSE(Merge(MapOf(Poses(0.0, 12)), MapOf(stands, kElsewhere, 70)).ok());
}

// Two aisles that look exactly alike, both in one map.
TEST_F(MergeTest, AnAisleThatLooksLikeAnotherIsNotMerged) {
  const Map aisle = MapOf(Poses(0.0, 9));
  const Map twin = RenumberedAbove(aisle, MapOf(Poses(0.0, 9), Embed3(Rigid2(0.0, 20.0, 0.0)), 40));
  const Expected<MergedMap> merged = Merge(UnionOf(aisle, twin), MapOf(Poses(0.6, 7), kElsewhere, 70));
  EXPECT_FALSE(merged.ok());
}

// ---- where one map lies in the other

SharedPlace PlaceAt(double x, double y, const Rigid2& T_known_other) {
  SharedPlace place;
  place.T_other_base = Embed3(Rigid2(x, y, 0.3));
  place.T_known_base = Embed3(T_known_other) * place.T_other_base;
  return place;
}

const Rigid2 kTrue(1.0, -2.0, 0.5);

TEST(Align, FindsTheTransformOfMost) {
  std::vector<SharedPlace> places;
  for (int k = 0; k < 6; ++k) places.push_back(PlaceAt(k, 0.2 * k, kTrue));
  places.push_back(PlaceAt(2.0, 3.0, Rigid2(5.0, 5.0, -1.0)));
  const Expected<MapAlignment> alignment = Align(places);
  ASSERT_TRUE(alignment.ok()) << alignment.error().message;
  EXPECT_LT(LogSe2(kTrue.Inverse() * ProjectToPlane(alignment->T_known_other)).norm(), 1e-9);
  EXPECT_EQ(alignment->places, (std::vector<std::size_t>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(alignment->apart, 6);
  EXPECT_LT(alignment->covariance.diagonal().cwiseSqrt().maxCoeff(), 0.05);
}

TEST(Align, IsLessSureOfPlacesThatScatter) {
  std::vector<SharedPlace> exact, scattered;
  for (int k = 0; k < 6; ++k) {
    exact.push_back(PlaceAt(k, 0.0, kTrue));
    scattered.push_back(PlaceAt(k, 0.0, kTrue * Rigid2(0.0, k % 2 == 0 ? 0.09 : -0.09, 0.0)));
  }
  const Expected<MapAlignment> a = Align(exact), b = Align(scattered);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_GT(b->covariance.trace(), 4.0 * a->covariance.trace());
}

TEST(Align, RefusesFewPlacesOneSpotAndTwoAnswers) {
  std::vector<SharedPlace> places = {PlaceAt(0.0, 0.0, kTrue), PlaceAt(1.0, 0.0, kTrue)};
  EXPECT_FALSE(Align({}).ok());
  EXPECT_FALSE(Align(places).ok());
  for (int k = 0; k < 9; ++k) places.push_back(PlaceAt(1.0 + 0.01 * k, 0.0, kTrue));
  EXPECT_FALSE(Align(places).ok());
  for (int k = 2; k < 6; ++k) places.push_back(PlaceAt(k, 0.0, kTrue));
  EXPECT_TRUE(Align(places).ok());
  for (int k = 0; k < 4; ++k) places.push_back(PlaceAt(k, 0.0, kTrue * Rigid2(0.0, 6.0, 0.0)));
  const Expected<MapAlignment> two = Align(places);
  ASSERT_FALSE(two.ok());
  EXPECT_NE(two.error().message.find("look alike"), std::string::npos);
}

TEST(Align, PlacesOfAnotherFloorDoNotAgree) {
  std::vector<SharedPlace> places;
  for (int k = 0; k < 3; ++k) {
    places.push_back(PlaceAt(k, 0.0, kTrue));
    places.back().T_known_base.translation.z() += 3.0 * k;
  }
  EXPECT_FALSE(Align(places).ok());
}

TEST(Contradiction, SpeaksWhereSweepsOrViewsDisagree) {
  PlaceTest agrees, unseen, other_walls;
  agrees.should_see = agrees.sees = agrees.has_sweeps = agrees.sweeps_agree = true;
  unseen.should_see = true;
  other_walls.should_see = other_walls.sees = other_walls.has_sweeps = true;
  EXPECT_FALSE(Contradiction({}).has_value());
  EXPECT_FALSE(Contradiction(std::vector<PlaceTest>(20, agrees)).has_value());
  EXPECT_TRUE(Contradiction(std::vector<PlaceTest>(20, unseen)).has_value());
  EXPECT_TRUE(Contradiction(std::vector<PlaceTest>(20, other_walls)).has_value());
  EXPECT_FALSE(Contradiction(std::vector<PlaceTest>(2, other_walls)).has_value()) << "too few to tell";
}

}  // namespace
}  // namespace planar_vslam
