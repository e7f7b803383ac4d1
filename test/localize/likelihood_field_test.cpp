#include "planar_vslam/localize/likelihood_field.h"

#include <gtest/gtest.h>

#include "floor_plan.h"
#include "planar_vslam/localize/pose_search.h"

namespace planar_vslam {
namespace {

TEST(LikelihoodField, SpeaksForSurfacesAndAgainstFreeSpace) {
  const LikelihoodField field(test::MappedOffice());
  EXPECT_NEAR(field.LogOdds(Eigen::Vector2d(6.0, 2.0)), LikelihoodField::kOnSurface, 0.1);
  EXPECT_NEAR(field.LogOdds(Eigen::Vector2d(2.0, 2.0)), LikelihoodField::kInFree, 0.02);
  EXPECT_NEAR(field.LogOdds(Eigen::Vector2d(9.0, 9.0)), LikelihoodField::kUnseen, 0.02) << "far outside";
  EXPECT_GT(LikelihoodField::kUnseen, LikelihoodField::kInFree);
  EXPECT_LT(field.LogOdds(Eigen::Vector2d(5.85, 2.0)), field.LogOdds(Eigen::Vector2d(5.95, 2.0)));
  EXPECT_NEAR(field.free_area(), 6.0 * 4.0, 3.0);
}

TEST(LikelihoodField, ASquareIsAsHighAsItsHighestCell) {
  const LikelihoodField field(test::MappedOffice());
  for (const int level : {1, 2, 3, 4}) {
    for (int row = -20; row < field.rows() + 20; row += 7) {
      for (int column = -20; column < field.columns() + 20; column += 5) {
        int highest = 0;
        bool stands = false;
        for (int y = row; y < row + (1 << level); ++y) {
          for (int x = column; x < column + (1 << level); ++x) {
            highest = std::max<int>(highest, field.Highest(0, x, y));
            stands = stands || field.MayStand(0, x, y);
          }
        }
        if (column >= -16 && row >= -16) {
          EXPECT_EQ(field.Highest(level, column, row), highest) << level << " " << column << " " << row;
          EXPECT_EQ(field.MayStand(level, column, row), stands);
        }
      }
    }
  }
}

TEST(LikelihoodField, KnowsWhatABeamWouldHaveGoneThrough) {
  const LikelihoodField field(test::MappedOffice());
  EXPECT_FALSE(field.Crosses({1.0, 2.0}, {6.0, 2.0}));
  EXPECT_TRUE(field.Crosses({1.0, 2.0}, {8.0, 2.0}));
}

TEST(LikelihoodField, OfNothingIsEmpty) {
  const LikelihoodField none({});
  EXPECT_TRUE(none.empty());
  test::FloorPlan open;
  open.Wall(100, 100, 101, 100);
  EXPECT_TRUE(LikelihoodField({open.Posed(Rigid2())}).empty());
  EXPECT_TRUE(FindPlaces(none, {{1.0, 0.0}}, std::nullopt, 5, 1.0).empty());
}

TEST(FindPlaces, FindsThePlaceOfASweep) {
  const LikelihoodField field(test::MappedOffice());
  for (const Rigid2& truth : {Rigid2(1.3, 1.1, 0.7), Rigid2(4.8, 2.2, -2.9), Rigid2(2.7, 3.1, 1.6)}) {
    const std::vector<Eigen::Vector2d> points =
        Thinned(PointsOf(test::Office().Sweep(truth), test::FloorPlan::T_base_laser()), 0.1);
    const std::vector<PlaceOdds> places = FindPlaces(field, points, std::nullopt, 5, 1.0);
    ASSERT_FALSE(places.empty());
    EXPECT_LT((places[0].T_map_base.translation - truth.translation).norm(), 0.06);
    EXPECT_LT(std::abs(WrapAngle(places[0].T_map_base.angle - truth.angle)), DegreesToRadians(2.0));
    for (std::size_t i = 1; i < places.size(); ++i) {
      EXPECT_LE(places[i].log_odds, places[0].log_odds);
      EXPECT_FALSE(IsSamePlace(places[i].T_map_base, places[0].T_map_base));
    }
  }
}

TEST(FindPlaces, StaysInItsArea) {
  const LikelihoodField field(test::MappedOffice());
  const Rigid2 truth(1.3, 1.1, 0.7);
  const std::vector<Eigen::Vector2d> points =
      Thinned(PointsOf(test::Office().Sweep(truth), test::FloorPlan::T_base_laser()), 0.1);
  const SearchArea around{Rigid2(1.6, 1.3, 0.5), 0.8, DegreesToRadians(20.0)};
  const std::vector<PlaceOdds> near = FindPlaces(field, points, around, 3, 1.0);
  ASSERT_FALSE(near.empty());
  EXPECT_LT((near[0].T_map_base.translation - truth.translation).norm(), 0.06);
  const SearchArea elsewhere{Rigid2(4.5, 2.0, 0.5), 0.8, DegreesToRadians(20.0)};
  for (const PlaceOdds& place : FindPlaces(field, points, elsewhere, 3, 1.0)) {
    EXPECT_LT((place.T_map_base.translation - elsewhere.center.translation).norm(), 1.1);
  }
}

}  // namespace
}  // namespace planar_vslam
