#include "planar_vslam/sim/truth_grid.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "planar_vslam/sim/scene.h"
#include "planar_vslam/sim/solids.h"
#include "sim_fixtures.h"
#include "support/support.h"

namespace planar_vslam {
namespace {

using test::BareRoom;

World FurnishedRoom() {
  World world = BareRoom();
  ObjectSpec table;
  table.kind = ObjectKind::kTable;
  table.at = {3.0, 2.5};
  table.size = {1.0, 0.6};
  table.height = 0.74;
  table.yaw = 0.4;
  ObjectSpec pillar;
  pillar.kind = ObjectKind::kPillar;
  pillar.at = {5.0, 4.0};
  pillar.size = {0.5, 0.5};
  pillar.height = 2.7;
  ObjectSpec chair;
  chair.kind = ObjectKind::kChair;
  chair.at = {1.0, 4.0};
  chair.height = 0.9;
  chair.yaw = -1.0;
  world.objects = {table, pillar, chair};
  return world;
}

bool OccupiedAt(const TruthGrid& grid, double x, double y) {
  return grid.Occupied(static_cast<int>(std::floor((x - grid.origin.x()) / grid.resolution)),
                       static_cast<int>(std::floor((y - grid.origin.y()) / grid.resolution)));
}

TEST(TruthGrid, BodyHitsTheTableTopTheLaserPlaneDoesNot) {
  const World world = FurnishedRoom();
  const TruthGrid body = MakeTruthGrid(world, kBodyLow, kBodyHigh), laser = MakeTruthGrid(world, 0.2499, 0.2501);
  EXPECT_TRUE(OccupiedAt(body, 3.0, 2.5));
  EXPECT_FALSE(OccupiedAt(laser, 3.0, 2.5));
  for (const TruthGrid& grid : {body, laser}) {
    EXPECT_TRUE(OccupiedAt(grid, 5.0, 4.0)) << "pillar";
    EXPECT_TRUE(OccupiedAt(grid, -0.02, 2.5)) << "wall";
    EXPECT_TRUE(OccupiedAt(grid, 6.02, 2.5)) << "wall";
    EXPECT_FALSE(OccupiedAt(grid, 0.02, 2.5)) << "beside the wall";
    EXPECT_FALSE(OccupiedAt(grid, 5.98, 0.02)) << "corner of the room";
    EXPECT_FALSE(OccupiedAt(grid, 2.0, 1.0)) << "open floor";
  }
}

TEST(TruthGrid, EveryLaserHitLiesOnAnOccupiedCellAndNoBeamCrossesASolid) {
  const World world = FurnishedRoom();
  std::vector<Prism> laser_solids;
  for (const Prism& solid : MakeSolids(world.objects)) {
    if (solid.MeetsBand(0.2499, 0.2501)) laser_solids.push_back(solid);
  }
  const Scene scene(world, 1);
  const TruthGrid grid = MakeTruthGrid(world, 0.2499, 0.2501);
  for (const Eigen::Vector3d& from : {Eigen::Vector3d(1.5, 1.5, 0.25), Eigen::Vector3d(4.2, 3.6, 0.25)}) {
    for (double angle = 0.003; angle < 2 * M_PI; angle += 0.01) {
      const Eigen::Vector3d direction(std::cos(angle), std::sin(angle), 0.0);
      const double range = scene.Range(from, direction, 20.0);
      const Eigen::Vector3d hit = from + (range + 0.002) * direction;
      EXPECT_TRUE(OccupiedAt(grid, hit.x(), hit.y())) << "beam at " << angle << " ends at " << hit.transpose();
      // Free on the way there: no solid the grid should know of may let the beam through.
      for (double along = 0.1; along < range - 0.1; along += 0.05) {
        const Eigen::Vector2d p = (from + along * direction).head<2>();
        for (const Prism& solid : laser_solids) ASSERT_GT(Distance(p, solid.footprint), 0.0) << p.transpose();
      }
    }
  }
}

TEST(TruthGrid, WritesMapServerFiles) {
  const test::TemporaryFolder folder;
  World world = BareRoom();
  ObjectSpec box;
  box.at = {1.0, 4.5};
  world.objects.push_back(box);
  const TruthGrid grid = MakeTruthGrid(world, kBodyLow, kBodyHigh);
  ASSERT_TRUE(WriteTruthGrid(grid, folder.path() / "truth.yaml").ok());
  std::ifstream image(folder.path() / "truth.pgm", std::ios::binary);
  std::string magic;
  int width = 0, height = 0, maximum = 0;
  image >> magic >> width >> height >> maximum;
  image.get();
  EXPECT_EQ(magic, "P5");
  EXPECT_EQ(width, 124);
  EXPECT_EQ(height, 104);
  std::string pixels(static_cast<std::size_t>(width * height), ' ');
  image.read(pixels.data(), static_cast<std::streamsize>(pixels.size()));
  ASSERT_TRUE(image.good());
  // The box is near the north wall: near the top of the picture.
  const auto at = [&](int row, int column) {
    return static_cast<unsigned char>(pixels[static_cast<std::size_t>(row * width + column)]);
  };
  EXPECT_EQ(at(12, 22), 0);
  EXPECT_EQ(at(91, 22), 254);
  std::ifstream yaml(folder.path() / "truth.yaml");
  std::stringstream text;
  text << yaml.rdbuf();
  EXPECT_NE(text.str().find("image: truth.pgm\nresolution: 0.05\norigin: [-0.1, -0.1, 0]\n"), std::string::npos)
      << text.str();
  EXPECT_FALSE(WriteTruthGrid(grid, folder.path() / "absent" / "truth.yaml").ok());
}

TEST(Solids, DistanceToAConvexPolygon) {
  const std::vector<Eigen::Vector2d> square = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  EXPECT_EQ(Distance({0.5, 0.5}, square), 0.0);
  EXPECT_NEAR(Distance({2.0, 0.5}, square), 1.0, 1e-12);
  EXPECT_NEAR(Distance({2.0, 2.0}, square), std::sqrt(2.0), 1e-12);
}

TEST(Solids, OverlapWithASquareNeedsSharedArea) {
  const std::vector<Eigen::Vector2d> diamond = {{0, -1}, {1, 0}, {0, 1}, {-1, 0}};
  EXPECT_TRUE(OverlapsSquare(diamond, {0.4, 0.4}, 0.5));
  EXPECT_FALSE(OverlapsSquare(diamond, {0.6, 0.6}, 0.5)) << "beyond the slanted side";
  EXPECT_FALSE(OverlapsSquare(diamond, {1.0, -0.5}, 1.0)) << "touching at a corner";
  EXPECT_TRUE(OverlapsSquare(diamond, {-0.05, -0.05}, 0.1)) << "the square inside";
}

}  // namespace
}  // namespace planar_vslam
