#include "planar_vslam/mapping2d/legged.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

constexpr double kCell = 0.05;  // m

// A free room of 6 m by 4 m with its corner at the origin; its walls are occupied.
OccupancyGrid2d Room() {
  OccupancyGrid2d grid;
  grid.width = 120, grid.height = 80, grid.resolution = kCell;
  grid.cells.assign(120 * 80, 0);
  for (int i = 0; i < 120; ++i)
    grid.cells[static_cast<std::size_t>(i)] = grid.cells[static_cast<std::size_t>(79 * 120 + i)] = 100;
  for (int i = 0; i < 80; ++i)
    grid.cells[static_cast<std::size_t>(i * 120)] = grid.cells[static_cast<std::size_t>(i * 120 + 119)] = 100;
  return grid;
}

void AddLeg(double x, double y, OccupancyGrid2d* grid) {
  const int u = static_cast<int>(x / kCell), v = static_cast<int>(y / kCell);
  for (int dv = 0; dv < 2; ++dv) {
    for (int du = 0; du < 2; ++du) grid->cells[static_cast<std::size_t>((v + dv) * grid->width + u + du)] = 100;
  }
}

// Legs at the corners of a rectangle, turned by `angle` about its first corner.
void AddLegs(double x, double y, double length, double depth, double angle, OccupancyGrid2d* grid) {
  const Eigen::Vector2d along(std::cos(angle), std::sin(angle)), across(-along.y(), along.x());
  for (const double u : {0.0, length}) {
    for (const double v : {0.0, depth}) {
      const Eigen::Vector2d p = Eigen::Vector2d(x, y) + u * along + v * across;
      AddLeg(p.x(), p.y(), grid);
    }
  }
}

bool IsCovered(const std::vector<Overhang>& overhangs, double x, double y) {
  return std::any_of(overhangs.begin(), overhangs.end(), [&](const Overhang& o) { return o.Contains({x, y}); });
}

std::vector<Overhang> Find(const LeggedEvidence& evidence) {
  return FindLegged(evidence, LeggedOptions{}, OverhangOptions{});
}

TEST(Legged, RectangleOfLegsIsFilledHoweverItIsTurned) {
  for (const double angle : {0.0, 0.3, 0.8, -1.2}) {
    LeggedEvidence evidence;
    evidence.laser = Room();
    AddLegs(2.5, 1.9, 1.4, 0.7, angle, &evidence.laser);
    const std::vector<Overhang> found = Find(evidence);
    ASSERT_EQ(found.size(), 1U) << angle;
    const Eigen::Vector2d middle = Eigen::Vector2d(2.5, 1.9) + 0.7 * Eigen::Vector2d(std::cos(angle), std::sin(angle)) +
                                   0.35 * Eigen::Vector2d(-std::sin(angle), std::cos(angle));
    EXPECT_TRUE(found[0].Contains(middle)) << angle;
    EXPECT_FALSE(found[0].Contains({5.5, 3.5})) << angle;
  }
}

TEST(Legged, ThreeLegsPillarsAndLegsFarApartAreNoFurniture) {
  LeggedEvidence evidence;
  evidence.laser = Room();
  AddLeg(1.0, 1.0, &evidence.laser);
  AddLeg(2.0, 1.0, &evidence.laser);
  AddLeg(2.0, 1.7, &evidence.laser);
  EXPECT_TRUE(Find(evidence).empty());
  evidence.laser = Room();
  AddLegs(1.0, 0.5, 3.5, 3.0, 0.0, &evidence.laser);
  EXPECT_TRUE(Find(evidence).empty());
  evidence.laser = Room();
  for (const double x : {1.0, 1.1, 1.2, 2.0, 2.1, 2.2}) {  // 0.3 m wide
    for (const double y : {1.0, 1.1, 1.2, 2.0, 2.1, 2.2}) AddLeg(x, y, &evidence.laser);
  }
  EXPECT_TRUE(Find(evidence).empty());
}

TEST(Legged, WhereTheRobotDroveNothingStands) {
  LeggedEvidence evidence;
  evidence.laser = Room();
  AddLegs(2.0, 1.5, 1.4, 0.8, 0.0, &evidence.laser);
  evidence.path = {{1.0, 1.0}, {2.7, 1.9}};
  EXPECT_TRUE(Find(evidence).empty());
}

TEST(Legged, WhatCamerasSawThroughAtEveryHeightIsNoTop) {
  LeggedEvidence evidence;
  evidence.laser = Room();
  AddLegs(2.0, 1.5, 1.4, 0.8, 0.0, &evidence.laser);
  // From a camera at 1.1 m to points low in the middle: the lines pass between the legs at all heights.
  for (int i = 0; i < 4; ++i) evidence.sight_lines.push_back({{2.4, 1.2, 1.1}, {2.7 + 0.05 * i, 1.9, 0.0}});
  EXPECT_EQ(Find(evidence).size(), 1U) << "near the camera's height they have not come in yet";
  for (int i = 0; i < 4; ++i) evidence.sight_lines.push_back({{2.6, 1.75, 1.1}, {2.7 + 0.05 * i, 1.9, 0.0}});
  EXPECT_TRUE(Find(evidence).empty());
}

// Points all over what lies between two legs in front and a wall, at y = 3.2 to 3.95.
void AddTopAtWall(double height, LeggedEvidence* evidence) {
  for (double x = 2.1; x < 3.4; x += 0.15) {
    for (double y = 3.3; y < 3.85; y += 0.15) evidence->points.emplace_back(x, y, height);
  }
}

TEST(Legged, TwoLegsBeforeAWallNeedPointsOfATop) {
  LeggedEvidence evidence;
  evidence.laser = Room();
  AddLeg(2.0, 3.2, &evidence.laser);
  AddLeg(3.4, 3.2, &evidence.laser);
  EXPECT_TRUE(Find(evidence).empty());
  AddTopAtWall(0.74, &evidence);
  const std::vector<Overhang> found = Find(evidence);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0].height, 0.74, 1e-9);
  EXPECT_TRUE(IsCovered(found, 2.7, 3.6));
  EXPECT_FALSE(IsCovered(found, 2.7, 2.9));
  for (int i = 0; i < 4; ++i) evidence.sight_lines.push_back({{2.5, 2.0, 1.1}, {2.6 + 0.05 * i, 3.9, 0.9}});
  EXPECT_EQ(Find(evidence).size(), 1U) << "seen above it only";
  for (int i = 0; i < 4; ++i) evidence.sight_lines.push_back({{2.5, 3.1, 1.1}, {2.6 + 0.05 * i, 3.8, 0.1}});
  EXPECT_TRUE(Find(evidence).empty());
}

TEST(Legged, WhatStandsAskewBeforeAWallEndsWhereItsFirstCornerMeetsIt) {
  LeggedEvidence evidence;
  evidence.laser = Room();
  const double angle = 0.4;
  const Eigen::Vector2d a(2.0, 2.75), along(std::cos(angle), std::sin(angle)), across(-along.y(), along.x());
  AddLeg(a.x(), a.y(), &evidence.laser);
  AddLeg((a + 1.4 * along).x(), (a + 1.4 * along).y(), &evidence.laser);
  const double depth = (3.95 - (a + 1.4 * along).y()) / across.y();  // to where the second side meets the wall
  for (double u = 0.1; u < 1.35; u += 0.12) {
    for (double v = 0.1; v < depth; v += 0.12) {
      const Eigen::Vector2d p = a + u * along + v * across;
      evidence.points.emplace_back(p.x(), p.y(), 0.74);
    }
  }
  const std::vector<Overhang> found = Find(evidence);
  const auto at = [&](double u, double v) -> Eigen::Vector2d { return a + u * along + v * across; };
  ASSERT_EQ(found.size(), 1U);
  EXPECT_TRUE(found[0].Contains(at(0.7, 0.5 * depth)));
  EXPECT_TRUE(found[0].Contains(at(0.2, depth - 0.1)));
  EXPECT_FALSE(found[0].Contains(at(0.2, depth + 0.25))) << "the wedge behind it";
}

TEST(Legged, PointsOnTheWallAloneAreNoTop) {
  LeggedEvidence evidence;
  evidence.laser = Room();
  AddLeg(2.0, 3.2, &evidence.laser);
  AddLeg(3.4, 3.2, &evidence.laser);
  for (double x = 2.1; x < 3.4; x += 0.05) evidence.points.emplace_back(x, 3.94, 0.74);
  EXPECT_TRUE(Find(evidence).empty());
}

TEST(Legged, NoLaserAndSwitchedOffMeansNone) {
  LeggedEvidence evidence;
  EXPECT_TRUE(Find(evidence).empty());
  evidence.laser = Room();
  AddLegs(2.0, 1.5, 1.4, 0.8, 0.0, &evidence.laser);
  LeggedOptions options;
  options.enabled = false;
  EXPECT_TRUE(FindLegged(evidence, options, OverhangOptions{}).empty());
}

TEST(LeggedOptions, EachBadFieldIsNamed) {
  EXPECT_TRUE(LeggedOptions{}.Problems().empty());
  LeggedOptions options;
  options.max_side = 0.1;
  ASSERT_EQ(options.Problems().size(), 1U);
  EXPECT_NE(options.Problems()[0].find("max_side"), std::string::npos);
}

}  // namespace
}  // namespace planar_vslam
