#include "planar_vslam/mapping2d/overhang.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "planar_vslam/mapping2d/map_builder.h"
#include "planar_vslam/mapping2d/sight_line.h"

namespace planar_vslam {
namespace {

using Points = std::vector<Eigen::Vector3d>;

// Even spread in [0, 1): fractional parts of multiples of an irrational number.
double Spread(int i, double irrational) { return std::fmod(i * irrational, 1.0); }

// `count` points on a level rectangle around (x, y), 1.2 m by 0.8 m, that are a centimetre or so off.
void AddTable(double x, double y, double height, int count, Points* points) {
  for (int i = 0; i < count; ++i) {
    points->emplace_back(x - 0.6 + 1.2 * Spread(i, M_SQRT2), y - 0.4 + 0.8 * Spread(i, std::sqrt(3.0)),
                         height - 0.015 + 0.03 * Spread(i, std::sqrt(5.0)));
  }
}

bool IsCovered(const std::vector<Overhang>& overhangs, double x, double y) {
  return std::any_of(overhangs.begin(), overhangs.end(), [&](const Overhang& o) { return o.Contains({x, y}); });
}

TEST(Overhang, TableTopIsFilledAndItsSurroundingsAreNot) {
  Points points;
  AddTable(2.0, 1.0, 0.75, 60, &points);
  const std::vector<Overhang> overhangs = FindOverhangs(points, OverhangOptions{});
  ASSERT_EQ(overhangs.size(), 1U);
  EXPECT_NEAR(overhangs[0].height, 0.75, 0.01);
  EXPECT_TRUE(IsCovered(overhangs, 2.0, 1.0));
  EXPECT_FALSE(IsCovered(overhangs, 2.0, 1.5));
  EXPECT_FALSE(IsCovered(overhangs, 2.7, 1.0));
}

TEST(Overhang, GapBetweenTwoTablesStaysOpenAndHeightsAreKeptApart) {
  Points points;
  AddTable(0.0, 0.0, 0.75, 80, &points);
  AddTable(2.2, 0.0, 0.75, 80, &points);  // a metre between them
  AddTable(0.0, 3.0, 0.45, 80, &points);
  const std::vector<Overhang> overhangs = FindOverhangs(points, OverhangOptions{});
  EXPECT_EQ(overhangs.size(), 3U);
  EXPECT_TRUE(IsCovered(overhangs, 0.0, 0.0) && IsCovered(overhangs, 2.2, 0.0) && IsCovered(overhangs, 0.0, 3.0));
  EXPECT_FALSE(IsCovered(overhangs, 1.1, 0.0));
}

TEST(Overhang, WallsFloorAndWhatIsAboveTheRobotAreNoFaces) {
  Points points;
  for (int i = 0; i < 400; ++i) points.emplace_back(4.0 * Spread(i, M_SQRT2), 0.0, 2.0 * Spread(i, std::sqrt(3.0)));
  AddTable(2.0, 3.0, 0.0, 60, &points);
  AddTable(2.0, 6.0, 1.9, 60, &points);
  EXPECT_TRUE(FindOverhangs(points, OverhangOptions{}).empty());
}

TEST(Overhang, FewPointsAndNoneMakeNone) {
  EXPECT_TRUE(FindOverhangs({}, OverhangOptions{}).empty());
  EXPECT_TRUE(FindOverhangs({{0.0, 0.0, 0.75}, {0.1, 0.0, 0.75}, {0.0, 0.1, 0.75}}, OverhangOptions{}).empty());
}

TEST(Overhang, BlocksTheGridButNotWhereTheRobotDrove) {
  Points points;
  AddTable(2.0, 1.0, 0.75, 80, &points);
  MapBuilder builder{MapBuilderOptions{}};
  builder.SetOverhangs(FindOverhangs(points, OverhangOptions{}));
  const auto occupied = [&builder] {
    const OccupancyGrid2d grid = builder.Grid();
    return std::count(grid.cells.begin(), grid.cells.end(), 100);
  };
  const long before = occupied();
  EXPECT_GT(before, 250) << "of the 384 cells that the table covers";
  builder.MarkFootprint({2.0, 1.0});
  EXPECT_LT(occupied(), before);
}

TEST(LinesThrough, CountsThoseThatPassWithinTheRim) {
  Overhang face;
  face.outlines = {{{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}}};
  const auto count = [&face](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    return LinesThrough({{from, to}}, face, 0.7, 0.1, 0.08);
  };
  EXPECT_EQ(count({0.5, 0.5, 1.1}, {0.5, 0.5, 0.0}), 1);
  EXPECT_EQ(count({-0.5, 0.5, 1.1}, {1.5, 0.5, 0.3}), 1) << "slanting, from outside";
  EXPECT_EQ(count({0.05, 0.5, 1.1}, {0.05, 0.5, 0.0}), 0) << "at the rim";
  EXPECT_EQ(count({1.5, 0.5, 1.1}, {1.5, 0.5, 0.0}), 0) << "beside it";
  EXPECT_EQ(count({0.5, 0.5, 1.1}, {0.5, 0.6, 0.65}), 0) << "ends on it";
  EXPECT_EQ(count({0.5, 0.5, 1.1}, {3.0, 0.5, 0.9}), 0) << "stays above";
  EXPECT_EQ(LinesThrough({}, face, 0.7, 0.1, 0.08), 0);
}

TEST(OverhangOptions, EachBadFieldIsNamed) {
  EXPECT_TRUE(OverhangOptions{}.Problems().empty());
  OverhangOptions options;
  options.max_gap = 0.0;
  ASSERT_EQ(options.Problems().size(), 1U);
  EXPECT_NE(options.Problems()[0].find("max_gap"), std::string::npos);
}

}  // namespace
}  // namespace planar_vslam
