#include "planar_vslam/pipeline/navigation_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

// A synthetic world whose keyframes hold two sweeps each.
test::SyntheticWorld WorldWithSweeps() {
  test::SyntheticWorldOptions options;
  options.keyframes = 40;
  test::SyntheticWorld world = test::MakeSyntheticWorld(options);
  std::mt19937 generator(2);
  std::uniform_real_distribution<float> range(0.5F, 7.0F);
  for (const KeyframeId id : world.map.keyframes.Ids()) {
    Keyframe& keyframe = world.map.keyframes.Edit(id);
    for (const double ahead : {0.0, 0.1}) {
      PlanarScan scan;
      scan.angle_min = -2.0, scan.angle_increment = 0.02;
      scan.range_max = 8.0;
      for (int i = 0; i < 200; ++i) scan.ranges.push_back(range(generator));
      LaserSweep sweep;
      sweep.scan = std::make_shared<const PlanarScan>(scan);
      sweep.T_base_laser.translation.z() = 0.25;
      sweep.T_keyframe_base = Rigid2(ahead, 0.0, 0.0);
      keyframe.sweeps.push_back(sweep);
    }
  }
  return world;
}

void ExpectSame(const MapBuilder& a, const MapBuilder& b) {
  const OccupancyGrid2d one = a.Grid(), other = b.Grid();
  EXPECT_EQ(one.width, other.width);
  EXPECT_EQ(one.height, other.height);
  EXPECT_EQ(one.origin, other.origin);
  EXPECT_EQ(one.cells, other.cells);
  EXPECT_EQ(a.VoxelCount(), b.VoxelCount());
}

// Points and the keyframes from `first` on go somewhere else, together.
void Move(KeyframeId first, const Rigid3& T_new_old, Map* map) {
  for (const KeyframeId id : map->keyframes.Ids()) {
    Keyframe& keyframe = map->keyframes.Edit(id);
    if (!(id < first)) keyframe.T_map_base = T_new_old * keyframe.T_map_base;
  }
  for (const LandmarkId id : map->landmarks.Ids()) {
    Landmark& landmark = map->landmarks.Edit(id);
    if (!(landmark.created_by < first)) landmark.p_map = T_new_old * landmark.p_map;
  }
}

TEST(NavigationMap, UpdatedEqualsRebuiltWhateverMovesComesAndGoes) {
  const test::SyntheticWorld world = WorldWithSweeps();
  NavigationMap navigation(MapBuilderOptions{}, LandmarkAcceptance{}, NavigationTolerance{});
  std::mt19937 generator(3);
  std::uniform_int_distribution<std::uint32_t> any(0, 39);
  std::normal_distribution<double> shift(0.0, 0.05);
  Map map = world.map;
  for (int round = 0; round < 8; ++round) {
    const Rigid3 T_new_old = Embed3(Rigid2(shift(generator), shift(generator), 0.2 * shift(generator)));
    Move(KeyframeId{any(generator)}, T_new_old, &map);
    Keyframe& changed = map.keyframes.Edit(KeyframeId{any(generator)});
    if (!changed.sweeps.empty()) changed.sweeps.pop_back();
    navigation.Update(map, world.camera);
    ExpectSame(navigation.builder(), BuildNavigationMap(map, world.camera, MapBuilderOptions{}, LandmarkAcceptance{}));
  }
}

TEST(NavigationMap, MovesWithinTheToleranceCostNothing) {
  const test::SyntheticWorld world = WorldWithSweeps();
  NavigationMap navigation(MapBuilderOptions{}, LandmarkAcceptance{}, NavigationTolerance::For(0.05));
  EXPECT_EQ(navigation.Update(world.map, world.camera), 40);
  EXPECT_EQ(navigation.Update(world.map, world.camera), 0);
  Map map = world.map;
  Move(KeyframeId{0}, Embed3(Rigid2(0.005, 0.0, 0.0)), &map);
  EXPECT_EQ(navigation.Update(map, world.camera), 0);
  Move(KeyframeId{0}, Embed3(Rigid2(0.5, 0.0, 0.0)), &map);
  EXPECT_EQ(navigation.Update(map, world.camera), 40);
  ExpectSame(navigation.builder(), BuildNavigationMap(map, world.camera, MapBuilderOptions{}, LandmarkAcceptance{}));
}

TEST(NavigationMap, OnlyWhatMovedIsIntegratedAnew) {
  const test::SyntheticWorld world = WorldWithSweeps();
  NavigationMap navigation(MapBuilderOptions{}, LandmarkAcceptance{}, NavigationTolerance::For(0.05));
  navigation.Update(world.map, world.camera);
  Map map = world.map;
  map.keyframes.Edit(KeyframeId{5}).sweeps.pop_back();
  EXPECT_EQ(navigation.Update(map, world.camera), 1);
}

// Cells that points make obstacles of.
long OccupiedByPoints(const test::SyntheticWorld& world, const LandmarkAcceptance& acceptance) {
  MapBuilderOptions options;
  options.layers = GridLayers::kVisual;
  const OccupancyGrid2d grid = BuildNavigationMap(world.map, world.camera, options, acceptance).Grid();
  return std::count(grid.cells.begin(), grid.cells.end(), 100);
}

TEST(NavigationMap, PointsBlockWhereOthersStandAboveOrBelow) {
  test::SyntheticWorldOptions options;
  options.keyframes = 40;
  options.points = 1500;
  test::SyntheticWorld world = test::MakeSyntheticWorld(options);
  LandmarkAcceptance alone;
  alone.min_upright = 0;
  alone.min_neighbors = 0;
  LandmarkAcceptance upright = alone;
  upright.min_upright = 2;
  const long scattered = OccupiedByPoints(world, alone);
  EXPECT_GT(scattered, 20);
  EXPECT_LT(OccupiedByPoints(world, upright), scattered / 5);
  upright.upright_radius = upright.neighbor_radius = 100.0;
  EXPECT_EQ(OccupiedByPoints(world, upright), scattered);
}

TEST(NavigationMap, PointsBlockWhereTheyProjectToWhatWasSeen) {
  test::SyntheticWorldOptions options;
  options.keyframes = 40;
  options.points = 1500;
  LandmarkAcceptance acceptance;
  acceptance.min_upright = 0;
  acceptance.min_neighbors = 0;
  EXPECT_GT(OccupiedByPoints(test::MakeSyntheticWorld(options), acceptance), 20);
  options.pixel_noise = 4.0 * acceptance.max_reprojection;
  EXPECT_EQ(OccupiedByPoints(test::MakeSyntheticWorld(options), acceptance), 0);
}

TEST(NavigationMap, DepthIsAsUncertainAsThePixelSigmaSays) {
  test::SyntheticWorldOptions options;
  options.keyframes = 40;
  options.points = 1500;
  const test::SyntheticWorld world = test::MakeSyntheticWorld(options);
  const auto occupied = [&world](double pixel_sigma) {
    LandmarkAcceptance acceptance = LandmarkAcceptance::For(pixel_sigma);
    acceptance.min_upright = 0;
    acceptance.min_neighbors = 0;
    return OccupiedByPoints(world, acceptance);
  };
  EXPECT_LT(occupied(20.0), occupied(1.0) / 2);
}

TEST(NavigationMap, MapWithoutScaleIsEmpty) {
  const test::SyntheticWorld world = WorldWithSweeps();
  NavigationMap navigation(MapBuilderOptions{}, LandmarkAcceptance{}, NavigationTolerance{});
  navigation.Update(world.map, world.camera);
  Map map = world.map;
  map.metric = false;
  navigation.Update(map, world.camera);
  EXPECT_EQ(navigation.builder().VoxelCount(), 0U);
  EXPECT_TRUE(navigation.builder().Grid().cells.empty());
}

}  // namespace
}  // namespace planar_vslam
