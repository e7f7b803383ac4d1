#include "planar_vslam/planar/floor_points.h"

#include <ceres/gradient_checker.h>
#include <gtest/gtest.h>

#include <random>

namespace planar_vslam::test {
namespace {

// A floor of points at `level`, noise `sigma`, under walls and furniture.
std::vector<Eigen::Vector3d> Room(double level, double sigma, int floor_points, std::mt19937* generator) {
  std::uniform_real_distribution<double> place(0.0, 4.0), height(-0.3, 2.0);
  std::normal_distribution<double> noise(0.0, sigma);
  std::vector<Eigen::Vector3d> points;
  for (int k = 0; k < floor_points; ++k)
    points.emplace_back(place(*generator), place(*generator), level + noise(*generator));
  for (int k = 0; k < 500; ++k) points.emplace_back(place(*generator), 4.0, height(*generator));
  return points;
}

TEST(FloorPoints, FindTheFloorWhereTheMapPutIt) {
  std::mt19937 generator(1);
  for (const double level : {0.0, -0.022, 0.03, -0.05}) {
    const std::vector<Eigen::Vector3d> points = Room(level, 0.01, 200, &generator);
    const FloorPoints floor = FindFloorPoints(points);
    EXPECT_NEAR(floor.level, level, 0.01) << level;
    EXPECT_GT(floor.indices.size(), 150U);
    EXPECT_TRUE(std::is_sorted(floor.indices.begin(), floor.indices.end()));
    for (const std::size_t i : floor.indices) EXPECT_NEAR(points[i].z(), level, 0.05);
  }
}

TEST(FloorPoints, AreNoneWhereNoFloorIsSeen) {
  std::mt19937 generator(2);
  EXPECT_TRUE(FindFloorPoints({}).indices.empty());
  EXPECT_TRUE(FindFloorPoints(Room(0.0, 0.01, 0, &generator)).indices.empty());
  EXPECT_TRUE(FindFloorPoints(Room(0.0, 0.01, 5, &generator)).indices.empty());
}

TEST(FloorPoints, SkirtingBoardsAreNoFloor) {
  // A line of many points at one height along a wall, and a floor of fewer: area decides, not number.
  std::mt19937 generator(3);
  std::vector<Eigen::Vector3d> points = Room(-0.01, 0.005, 120, &generator);
  std::uniform_real_distribution<double> place(0.0, 4.0);
  for (int k = 0; k < 600; ++k) points.emplace_back(place(generator), 4.0, 0.05);
  EXPECT_NEAR(FindFloorPoints(points).level, -0.01, 0.0101);
}

TEST(FloorPointFactor, IsZeroOnTheFloorAndItsGradientIsRight) {
  const FloorPointFactor factor(0.03);
  double point[3] = {1.5, -2.0, 0.0};
  const double* blocks[1] = {point};
  double residual = 1.0;
  ASSERT_TRUE(factor.Evaluate(blocks, &residual, nullptr));
  EXPECT_EQ(residual, 0.0);
  const ceres::GradientChecker checker(&factor, static_cast<const std::vector<const ceres::Manifold*>*>(nullptr),
                                       ceres::NumericDiffOptions());
  for (const double z : {-0.1, 0.0, 0.02, 3.0}) {
    point[2] = z;
    EXPECT_TRUE(checker.Probe(blocks, 1e-7, nullptr));
  }
}

}  // namespace
}  // namespace planar_vslam::test
