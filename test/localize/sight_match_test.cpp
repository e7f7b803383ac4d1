#include "planar_vslam/localize/sight_match.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

SightView ViewFrom(const test::SyntheticWorld& world, const Rigid3& T_map_base, const Rigid3& T_map_now) {
  const auto seen = test::Observe(world, T_map_base * world.T_base_camera, 0.5, 1);
  return {ProjectToPlane(T_map_now.Inverse() * T_map_base),
          CameraView{seen.features, world.T_base_camera, world.camera, PlanarPriorOptions{}, 1.0}};
}

TEST(SightMatch, LandmarksThatAreSeenAgainTellNothingNew) {
  const test::SyntheticWorld world = MakeSyntheticWorld(test::SyntheticWorldOptions{});
  const LandmarkTable table(world.map);
  const Rigid3 T_map_base = test::SyntheticPose(0.8);
  const std::vector<SightView> once{ViewFrom(world, T_map_base, T_map_base)};
  const std::vector<SightView> often(15, once.front());
  const Rigid2 guess = ProjectToPlane(T_map_base) * Rigid2(0.05, -0.03, 0.01);
  const SettledPlace by_one = Settle(table, guess, once), by_many = Settle(table, guess, often);
  EXPECT_LT((by_one.T_map_base.translation - ProjectToPlane(T_map_base).translation).norm(), 0.02);
  EXPECT_TRUE(by_many.covariance.isApprox(by_one.covariance, 0.01));
}

// The more landmarks, the better they tell the place, but for what is wrong with all of them.
TEST(SightMatch, ManyLandmarksAreNoBetterThanTheCameraIs) {
  const auto sigma = [](int points) {
    test::SyntheticWorldOptions options;
    options.points = points;
    const test::SyntheticWorld world = MakeSyntheticWorld(options);
    const Rigid3 T_map_base = test::SyntheticPose(0.8);
    const std::vector<SightView> views{ViewFrom(world, T_map_base, T_map_base)};
    constexpr double kModel = 0.06;  // m, in all covariances
    return std::sqrt(Settle(LandmarkTable(world.map), ProjectToPlane(T_map_base), views).covariance(0, 0) -
                     kModel * kModel);
  };
  const double few = sigma(15), many = sigma(300), very_many = sigma(1200);
  EXPECT_LT(many, 0.9 * few);
  EXPECT_NEAR(very_many, many, 0.3 * many);
}

// The same landmarks, seen from place to place, have the same errors: they do not average out.
TEST(SightMatch, ConfirmingAPlaceForSomeMetresMakesItNoBetterThanTheLandmarksAre) {
  constexpr int kViews = 15;
  constexpr double kBest = 0.03;  // m
  const test::SyntheticWorld world = MakeSyntheticWorld(test::SyntheticWorldOptions{});
  const LandmarkTable table(world.map);
  const Rigid3 T_map_base = test::SyntheticPose(0.8);
  const std::vector<SightView> views{ViewFrom(world, T_map_base, T_map_base)};
  SettledPlace place{ProjectToPlane(T_map_base) * Rigid2(0.1, 0.05, 0.0)};
  place.covariance = Eigen::Vector3d(0.1, 0.1, 0.03).cwiseAbs2().asDiagonal();
  for (int i = 0; i < kViews; ++i) place = SettleExpected(table, place, views, 1.0 / kViews);
  EXPECT_GT(std::sqrt(place.covariance(0, 0)), kBest);
  EXPECT_GT(std::sqrt(place.covariance(1, 1)), kBest);
  EXPECT_LT((place.T_map_base.translation - ProjectToPlane(T_map_base).translation).norm(), 0.06);
}

// What a place may be off is as many pixels for a keypoint of any octave.
TEST(SightMatch, TheWindowOfAPlaceDoesNotGrowWithTheOctave) {
  constexpr double kScale = 3.6;
  test::SyntheticWorld world = MakeSyntheticWorld(test::SyntheticWorldOptions{});
  world.map.octave_scales = {kScale};
  const LandmarkTable table(world.map);
  const Rigid3 T_map_base = test::SyntheticPose(0.8);
  const std::vector<SightView> views{ViewFrom(world, T_map_base, T_map_base)};
  const Rigid2 turned = ProjectToPlane(T_map_base) * Rigid2(0.0, 0.0, DegreesToRadians(2.0));  // 21 px and more
  EXPECT_GT(Compare(table, turned, views, {0.0, 12.0}).share(), 0.5);
  EXPECT_LT(Compare(table, turned, views, {8.0, 2.0}).share(), 0.1);
}

TEST(SightMatch, EachUniqueLandmarkCountsOnce) {
  const test::SyntheticWorld world = MakeSyntheticWorld(test::SyntheticWorldOptions{});
  const LandmarkTable table(world.map);
  const Rigid3 T_map_base = test::SyntheticPose(0.8);
  const std::vector<SightView> twice(2, ViewFrom(world, T_map_base, T_map_base));
  constexpr SightWindow kWindow{0.0, 6.0};
  const Agreement all = Compare(table, ProjectToPlane(T_map_base), twice, kWindow);
  const AgreementByKind by_kind = CompareByKind(table, ProjectToPlane(T_map_base), twice, kWindow);
  EXPECT_GT(all.found, 100);
  EXPECT_DOUBLE_EQ(2.0 * by_kind.unique.visible, all.visible);
  EXPECT_DOUBLE_EQ(2.0 * by_kind.unique.found, all.found);
  EXPECT_DOUBLE_EQ(by_kind.steady_unique.visible, by_kind.unique.visible);  // descriptors are the same in all views
  EXPECT_DOUBLE_EQ(by_kind.steady_alike.visible, 0.0);
}

}  // namespace
}  // namespace planar_vslam
