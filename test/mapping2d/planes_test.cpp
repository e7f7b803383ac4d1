#include "planar_vslam/mapping2d/planes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "planar_vslam/geometry/angles.h"

namespace planar_vslam {
namespace {

using Points = std::vector<Eigen::Vector3d>;

class Cloud {
 public:
  double Uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(generator_); }
  double Noise() { return std::normal_distribution<double>(0.0, 0.01)(generator_); }

  // 8 m by 6 m, at `height` in the origin, rising by `slope` along x.
  void AddFloor(int count, double height, double slope) {
    for (int i = 0; i < count; ++i) {
      const double x = Uniform(-4.0, 4.0);
      points.emplace_back(x, Uniform(-3.0, 3.0), height + slope * x + Noise());
    }
  }
  void AddWall(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double bottom, double top, int count) {
    const Eigen::Vector2d along = to - from, across = Eigen::Vector2d(-along.y(), along.x()).normalized();
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector2d p = from + Uniform(0.0, 1.0) * along + Noise() * across;
      points.emplace_back(p.x(), p.y(), Uniform(bottom, top));
    }
  }
  void AddClutter(double bottom, double top, int count) {
    for (int i = 0; i < count; ++i) points.emplace_back(Uniform(-4.0, 4.0), Uniform(-3.0, 3.0), Uniform(bottom, top));
  }

  Points points;

 private:
  std::mt19937 generator_{5};
};

TEST(FindFloor, HeightAndTiltAreMeasuredAmongClutterAndMirrorImages) {
  for (const double slope : {0.0, 0.02, -0.05}) {
    Cloud cloud;
    cloud.AddFloor(300, 0.08, slope);
    cloud.AddClutter(0.1, 2.0, 600);
    cloud.AddClutter(-2.0, -0.1, 300);
    const std::optional<FloorPlane> floor = FindFloor(cloud.points, PlaneOptions{});
    ASSERT_TRUE(floor.has_value()) << slope;
    EXPECT_NEAR(floor->HeightOf({0.0, 0.0, 0.08}), 0.0, 0.01) << slope;
    EXPECT_NEAR(floor->TiltDegrees(), RadiansToDegrees(std::atan(std::abs(slope))), 0.3) << slope;
    EXPECT_GT(floor->points, 250);
    EXPECT_LT(floor->rms, 0.03);
    EXPECT_LT(floor->HeightOf({1.0, 1.0, -0.5}), -0.3);
  }
}

TEST(FindFloor, WithoutAFloorThereIsNone) {
  EXPECT_FALSE(FindFloor({}, PlaneOptions{}).has_value());
  Cloud walls;
  walls.AddWall({-4.0, -3.0}, {4.0, -3.0}, -0.5, 2.0, 500);
  walls.AddClutter(-0.5, 2.0, 800);
  EXPECT_FALSE(FindFloor(walls.points, PlaneOptions{}).has_value());
  Cloud table;  // level, but no floor
  table.AddFloor(300, 0.75, 0.0);
  EXPECT_FALSE(FindFloor(table.points, PlaneOptions{}).has_value());
  Cloud few;
  few.AddFloor(20, 0.0, 0.0);
  EXPECT_FALSE(FindFloor(few.points, PlaneOptions{}).has_value());
}

TEST(FindWalls, FindsEachWallWithItsEndsAndHeights) {
  Cloud cloud;
  cloud.AddWall({-4.0, -3.0}, {4.0, -3.0}, 0.4, 2.2, 500);
  cloud.AddWall({4.0, -3.0}, {3.0, 3.0}, 0.4, 1.8, 300);
  cloud.AddFloor(300, 0.0, 0.0);
  cloud.AddClutter(0.4, 2.0, 150);
  const std::vector<WallPlane> walls = FindWalls(cloud.points, PlaneOptions{});
  ASSERT_EQ(walls.size(), 2U);
  EXPECT_NEAR((walls[0].to - walls[0].from).norm(), 8.0, 0.3);
  EXPECT_NEAR(walls[0].from.y(), -3.0, 0.05);
  EXPECT_NEAR(walls[0].to.y(), -3.0, 0.05);
  EXPECT_NEAR(walls[0].top, 2.2, 0.1);
  EXPECT_NEAR((walls[1].to - walls[1].from).norm(), std::hypot(1.0, 6.0), 0.4);
  EXPECT_GE(walls[0].points, walls[1].points);
  EXPECT_LT(walls[0].rms, 0.03);
}

TEST(FindWalls, ADoorwayDividesAndATableTopIsNone) {
  Cloud cloud;
  cloud.AddWall({-4.0, 0.0}, {-1.0, 0.0}, 0.4, 2.0, 300);
  cloud.AddWall({1.0, 0.0}, {4.0, 0.0}, 0.4, 2.0, 200);
  EXPECT_EQ(FindWalls(cloud.points, PlaneOptions{}).size(), 2U);
  Cloud table;
  table.AddFloor(500, 0.75, 0.0);
  EXPECT_TRUE(FindWalls(table.points, PlaneOptions{}).empty());
  EXPECT_TRUE(FindWalls({}, PlaneOptions{}).empty());
}

}  // namespace
}  // namespace planar_vslam
