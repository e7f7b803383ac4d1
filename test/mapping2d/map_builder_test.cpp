#include "planar_vslam/mapping2d/map_builder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

namespace planar_vslam {
namespace {

constexpr float kNoReturn = std::numeric_limits<float>::infinity();
constexpr double kLaserHeight = 0.25;
const Eigen::Vector2d kRobot(0.025, 0.025);  // the middle of a cell

MapBuilderOptions WithoutFootprint() {
  MapBuilderOptions options;
  options.footprint_radius = 0.0;
  return options;
}

// A scan of `ranges` from kRobot, beams spread evenly over the full circle from angle 0.
PosedScan ScanOf(const std::vector<float>& ranges) {
  PosedScan scan;
  scan.T_map_laser.translation << kRobot, kLaserHeight;
  scan.angle_increment = 2.0 * M_PI / static_cast<double>(ranges.size());
  scan.range_min = 0.05;
  scan.range_max = 10.0;
  scan.ranges = &ranges;
  scan.level_height = kLaserHeight;
  return scan;
}

void Repeat(int times, const std::function<void()>& action) {
  for (int i = 0; i < times; ++i) action();
}

// Cell value under a position; -1 outside the grid.
int At(const OccupancyGrid2d& grid, double x, double y) {
  const int u = static_cast<int>(std::floor((x - grid.origin.x()) / grid.resolution));
  const int v = static_cast<int>(std::floor((y - grid.origin.y()) / grid.resolution));
  return u >= 0 && v >= 0 && u < grid.width && v < grid.height ? grid.At(u, v) : -1;
}

long Count(const OccupancyGrid2d& grid, std::int8_t value) {
  return std::count(grid.cells.begin(), grid.cells.end(), value);
}

void ExpectSame(const OccupancyGrid2d& a, const OccupancyGrid2d& b) {
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  EXPECT_EQ(a.origin, b.origin);
  EXPECT_EQ(a.cells, b.cells);
}

// What a keyframe at `camera` says of points that are known exactly.
PosedPoints SeenFrom(const Eigen::Vector3d& camera, const std::vector<Eigen::Vector3d>& points) {
  PosedPoints seen;
  seen.camera_in_map = camera;
  for (const Eigen::Vector3d& p : points) seen.points.push_back({p, 0.0});
  return seen;
}

TEST(MapBuilder, EmptyMapGivesAnEmptyGrid) {
  const MapBuilder builder{MapBuilderOptions{}};
  EXPECT_TRUE(builder.Grid().cells.empty());
  EXPECT_EQ(builder.VoxelCount(), 0U);
}

TEST(MapBuilder, BeamFreesTheWayAndOccupiesItsEnd) {
  MapBuilder builder(WithoutFootprint());
  const std::vector<float> ranges = {2.0F};
  Repeat(4, [&] { builder.InsertScan(ScanOf(ranges)); });
  const OccupancyGrid2d grid = builder.Grid();
  EXPECT_EQ(At(grid, 2.025, 0.025), 100);
  for (double x = 0.025; x < 1.9; x += 0.05) EXPECT_EQ(At(grid, x, 0.025), 0) << x;
  EXPECT_EQ(At(grid, 2.075, 0.025), -1) << "nothing is known behind a hit";
  EXPECT_EQ(At(grid, 1.0, 0.125), -1) << "nothing is known beside the beam";
  EXPECT_EQ(Count(grid, 100), 1);
}

TEST(MapBuilder, BeamsWithoutReturnClearOnlyUpToTheRangeLimit) {
  for (const float range : {kNoReturn, 10.0F, 8.5F}) {
    MapBuilder builder(WithoutFootprint());  // laser_range 8 m, below the scan's 10 m
    const std::vector<float> ranges = {range};
    Repeat(4, [&] { builder.InsertScan(ScanOf(ranges)); });
    const OccupancyGrid2d grid = builder.Grid();
    EXPECT_EQ(Count(grid, 100), 0) << range;
    EXPECT_EQ(At(grid, 7.9, 0.025), 0) << range;
    EXPECT_EQ(At(grid, 8.1, 0.025), -1) << range;
  }
}

TEST(MapBuilder, BeamsTooCloseToMeasureSayNothing) {
  for (const float range : {0.0F, 0.04F, -kNoReturn}) {
    MapBuilder builder(WithoutFootprint());
    const std::vector<float> ranges = {range};
    Repeat(4, [&] { builder.InsertScan(ScanOf(ranges)); });
    EXPECT_EQ(builder.VoxelCount(), 0U) << range;
  }
}

TEST(MapBuilder, OccupiedWinsOverFreeWithinOneScan) {
  MapBuilder builder(WithoutFootprint());
  std::vector<float> ranges(2000, kNoReturn);  // 0.18 deg apart: many beams cross the cell that one of them hits
  ranges[0] = 1.0F;
  Repeat(10, [&] { builder.InsertScan(ScanOf(ranges)); });
  EXPECT_EQ(At(builder.Grid(), 1.025, 0.025), 100);
}

TEST(MapBuilder, FreeSpaceSeenLaterClearsWhatMovedAway) {
  MapBuilder builder(WithoutFootprint());
  const std::vector<float> blocked = {1.0F}, open = {3.0F};
  Repeat(5, [&] { builder.InsertScan(ScanOf(blocked)); });
  ASSERT_EQ(At(builder.Grid(), 1.025, 0.025), 100);
  Repeat(50, [&] { builder.InsertScan(ScanOf(open)); });
  EXPECT_EQ(At(builder.Grid(), 1.025, 0.025), 0);
}

TEST(MapBuilder, ScanDirectionFollowsThePose) {
  MapBuilder builder(WithoutFootprint());
  const std::vector<float> ranges = {1.0F};
  PosedScan scan = ScanOf(ranges);
  scan.T_map_laser = Embed3(Rigid2(1.025, 2.025, M_PI_2));
  scan.T_map_laser.translation.z() = kLaserHeight;
  Repeat(2, [&] { builder.InsertScan(scan); });
  EXPECT_EQ(At(builder.Grid(), 1.025, 3.025), 100);
}

TEST(MapBuilder, TiltAndHeightJitterOfALevelLaserDoNotSplitItsEvidence) {
  std::mt19937 generator(3);
  std::normal_distribution<double> tilt(0.0, DegreesToRadians(0.5)), height(0.0, 0.01);
  const std::vector<float> blocked(90, 4.0F), open(90, 6.0F);
  MapBuilder jittered(WithoutFootprint()), steady(WithoutFootprint());
  for (int i = 0; i < 60; ++i) {
    const std::vector<float>& ranges = i < 5 ? blocked : open;
    steady.InsertScan(ScanOf(ranges));
    PosedScan scan = ScanOf(ranges);
    scan.T_map_laser.rotation = ExpSo3({tilt(generator), tilt(generator), 0.0});
    scan.T_map_laser.translation.z() += height(generator);
    jittered.InsertScan(scan);
  }
  EXPECT_EQ(Count(steady.Grid(), 100), Count(jittered.Grid(), 100));
  EXPECT_EQ(At(jittered.Grid(), 4.025, 0.025), 0) << "what was seen blocked, then open, is open at whatever tilt";
}

TEST(MapBuilder, TiltedLaserSeesTheFloorAsFree) {
  MapBuilder builder(WithoutFootprint());
  const double down = DegreesToRadians(30.0);
  const std::vector<float> ranges = {static_cast<float>(kLaserHeight / std::sin(down))};
  PosedScan scan = ScanOf(ranges);
  scan.T_map_laser.rotation = ExpSo3({0.0, down, 0.0});  // the x axis dips
  scan.level_height.reset();
  Repeat(5, [&] { builder.InsertScan(scan); });
  EXPECT_EQ(Count(builder.Grid(), 100), 0);
  EXPECT_GT(Count(builder.Grid(), 0), 0);
}

TEST(MapBuilder, PointSeenTwiceIsAnObstacleAndItsRaysAreFree) {
  MapBuilder builder(WithoutFootprint());
  const Eigen::Vector3d point(2.025, 0.025, 0.525);
  builder.InsertPoints(SeenFrom({0.025, 0.025, 0.525}, {point}));
  EXPECT_EQ(Count(builder.Grid(), 100), 0) << "one keyframe is not enough";
  Repeat(4, [&] { builder.InsertPoints(SeenFrom({0.025, 0.025, 0.525}, {point})); });
  const OccupancyGrid2d grid = builder.Grid();
  EXPECT_EQ(At(grid, 2.025, 0.025), 100);
  EXPECT_EQ(At(grid, 1.025, 0.025), 0);
  EXPECT_EQ(At(grid, 2.075, 0.025), -1);
}

TEST(MapBuilder, UncertainDepthFreesLessAndWeighsLess) {
  const auto grid_for = [](double sigma) {
    MapBuilder builder(WithoutFootprint());
    PosedPoints seen;
    seen.camera_in_map = {0.025, 0.025, 0.525};
    seen.points = {{{3.025, 0.025, 0.525}, sigma}};
    Repeat(5, [&] { builder.InsertPoints(seen); });
    return builder.Grid();
  };
  const OccupancyGrid2d sure = grid_for(0.01), unsure = grid_for(0.3);
  EXPECT_EQ(At(sure, 3.025, 0.025), 100);
  EXPECT_EQ(At(sure, 2.625, 0.025), 0);
  EXPECT_EQ(At(unsure, 3.025, 0.025), -1);
  EXPECT_EQ(At(unsure, 2.625, 0.025), -1) << "closer than two sigmas to the point";
  EXPECT_EQ(At(unsure, 2.325, 0.025), 0);
}

TEST(MapBuilder, FloorPointsAndFarPointsOnlyClear) {
  MapBuilder builder(WithoutFootprint());
  const Eigen::Vector3d camera(0.025, 0.025, 1.125);
  Repeat(10, [&] {
    builder.InsertPoints(SeenFrom(camera, {{2.0, 0.0, 0.01}, {2.0, 1.0, -0.03}, {2.0, -1.0, -0.5}, {7.0, 0.0, 1.0}}));
  });
  const OccupancyGrid2d grid = builder.Grid();
  EXPECT_EQ(Count(grid, 100), 0);
  EXPECT_GT(Count(grid, 0), 0);
  EXPECT_EQ(At(grid, 6.2, 0.025), -1) << "beyond visual_range";
}

TEST(MapBuilder, OnlyTheHeightBandBlocks) {
  for (const double z : {0.075, 0.525, 1.275, 1.325, 2.0}) {
    MapBuilder builder(WithoutFootprint());
    const Eigen::Vector3d camera(0.025, 0.025, z);
    Repeat(5, [&] { builder.InsertPoints(SeenFrom(camera, {{1.025, 0.025, z}})); });
    const bool in_band = z > 0.10 && z < 1.30;
    EXPECT_EQ(Count(builder.Grid(), 100), in_band ? 1 : 0) << z;
    EXPECT_EQ(Count(builder.Grid(), 0) > 0, in_band) << z;
    EXPECT_GT(builder.VoxelCount(), 0U);
  }
}

TEST(MapBuilder, AnotherBandCountsForWhatIsInItAlready) {
  MapBuilder builder(WithoutFootprint());
  Repeat(6, [&] { builder.InsertPoints(SeenFrom({0.025, 0.025, 0.525}, {{2.025, 0.025, 1.525}})); });
  EXPECT_EQ(Count(builder.Grid(), 100), 0);
  builder.SetBand(0.1, 1.8);
  EXPECT_EQ(Count(builder.Grid(), 100), 1);
  builder.SetBand(1.6, 1.8);
  EXPECT_EQ(Count(builder.Grid(), 100), 0);
}

TEST(MapBuilder, LaserBelowTheBandCountsAndAboveItDoesNot) {
  for (const double height : {0.06, kLaserHeight, 1.6}) {
    MapBuilder builder(WithoutFootprint());
    const std::vector<float> ranges = {2.0F};
    PosedScan scan = ScanOf(ranges);
    scan.level_height = height;
    Repeat(4, [&] { builder.InsertScan(scan); });
    EXPECT_EQ(Count(builder.Grid(), 100), height < 1.3 ? 1 : 0) << height;
  }
}

TEST(MapBuilder, FootprintIsFreeEvenWhereSomethingWasSeen) {
  MapBuilderOptions options;
  options.footprint_radius = 0.2;
  MapBuilder builder(options);
  const std::vector<float> ranges = {2.0F};
  Repeat(3, [&] { builder.InsertScan(ScanOf(ranges)); });
  builder.MarkFootprint({2.025, 0.025});
  builder.MarkFootprint({-3.025, 0.025});
  const OccupancyGrid2d grid = builder.Grid();
  EXPECT_EQ(At(grid, 2.025, 0.025), 0);
  EXPECT_EQ(At(grid, -3.025, 0.025), 0) << "the grid grows with the path";
  EXPECT_EQ(At(grid, -3.025, 0.175), 0);
  EXPECT_EQ(At(grid, -3.025, 0.275), -1);
}

TEST(MapBuilder, TableTopSeenByTheCameraBlocksWhereTheLaserPassesBelow) {
  MapBuilder builder(WithoutFootprint());
  const std::vector<float> ranges = {4.0F};
  const Eigen::Vector3d camera(0.025, 0.025, 1.125), table(2.025, 0.025, 0.725);
  Repeat(10, [&] {
    builder.InsertScan(ScanOf(ranges));
    builder.InsertPoints(SeenFrom(camera, {table}));
  });
  EXPECT_EQ(At(builder.Grid(), 2.025, 0.025), 100);
}

TEST(MapBuilder, LayersAddTheirEvidenceInSharedVoxels) {
  const std::vector<float> blocked = {2.0F}, open = {4.0F};
  const Eigen::Vector3d camera(0.025, 0.025, kLaserHeight + 0.001), point(2.025, 0.025, kLaserHeight + 0.001);
  MapBuilder points_only(WithoutFootprint()), both(WithoutFootprint()), agreeing(WithoutFootprint());
  Repeat(2, [&] {
    for (MapBuilder* builder : {&points_only, &both, &agreeing}) builder->InsertPoints(SeenFrom(camera, {point}));
  });
  Repeat(10, [&] { both.InsertScan(ScanOf(open)); });
  agreeing.InsertScan(ScanOf(blocked));
  EXPECT_EQ(At(points_only.Grid(), point.x(), point.y()), 100);
  EXPECT_NE(At(both.Grid(), point.x(), point.y()), 100) << "ten scans through outweigh two uncertain points";
  EXPECT_EQ(At(agreeing.Grid(), point.x(), point.y()), 100);
}

TEST(MapBuilder, OrderOfPointsAndOfLayersDoesNotMatter) {
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> position(-3.0, 3.0), height(0.0, 1.2), range(0.5, 5.0);
  std::vector<PosedPoints> keyframes;
  std::vector<std::vector<float>> scans;
  for (int i = 0; i < 5; ++i) {
    std::vector<Eigen::Vector3d> points;
    for (int k = 0; k < 100; ++k) points.emplace_back(position(generator), position(generator), height(generator));
    keyframes.push_back(SeenFrom({0.1 * i, 0.0, 1.1}, points));
    std::vector<float> ranges;
    for (int k = 0; k < 180; ++k) ranges.push_back(static_cast<float>(range(generator)));
    scans.push_back(ranges);
  }
  MapBuilder alternating{MapBuilderOptions{}}, one_by_one{MapBuilderOptions{}};
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    alternating.InsertPoints(keyframes[i]);
    alternating.InsertScan(ScanOf(scans[i]));
  }
  for (const std::vector<float>& ranges : scans) one_by_one.InsertScan(ScanOf(ranges));
  for (PosedPoints keyframe : keyframes) {
    std::shuffle(keyframe.points.begin(), keyframe.points.end(), generator);
    one_by_one.InsertPoints(keyframe);
  }
  ExpectSame(alternating.Grid(), one_by_one.Grid());
  EXPECT_EQ(alternating.VoxelCount(), one_by_one.VoxelCount());
}

TEST(MapBuilder, ThinLegSurvivesThePosesErrorAndTheBeamsThatPassIt) {
  std::mt19937 generator(5);
  std::normal_distribution<double> error(0.0, 0.02);
  MapBuilder builder(WithoutFootprint());
  std::vector<float> ranges(720, 4.0F);  // 0.5 deg apart
  ranges[0] = ranges[1] = 2.0F;          // a leg of 3 cm before a wall
  for (int i = 0; i < 100; ++i) {
    PosedScan scan = ScanOf(ranges);
    scan.T_map_laser.translation += Eigen::Vector3d(error(generator), error(generator), 0.0);
    builder.InsertScan(scan);
  }
  EXPECT_EQ(At(builder.Grid(), 2.025, 0.025), 100);
}

TEST(MapBuilder, LaterEpochOverrulesWhatStoodLongInAnEarlierOne) {
  const std::vector<float> blocked = {1.0F}, open = {3.0F};
  PosedScan earlier = ScanOf(blocked), later = ScanOf(open);
  later.epoch = 1;
  MapBuilder builder(WithoutFootprint());
  Repeat(20, [&] { builder.InsertScan(later); });
  Repeat(500, [&] { builder.InsertScan(earlier); });  // the order of the epochs counts, not that of the calls
  EXPECT_EQ(At(builder.Grid(), 1.025, 0.025), 0);
}

TEST(MapBuilder, WhatWasRemovedLeavesNoTrace) {
  std::mt19937 generator(11);
  std::uniform_real_distribution<double> position(-3.0, 3.0), height(0.0, 1.2), range(0.5, 5.0);
  std::vector<PosedPoints> keyframes;
  std::vector<std::vector<float>> ranges(12);
  std::vector<PosedScan> scans;
  for (int i = 0; i < 12; ++i) {
    std::vector<Eigen::Vector3d> points;
    for (int k = 0; k < 80; ++k) points.emplace_back(position(generator), position(generator), height(generator));
    keyframes.push_back(SeenFrom({0.1 * i, 0.0, 1.1}, points));
    for (PosedPoint& point : keyframes.back().points) point.depth_sigma = 0.01 * range(generator);
    for (int k = 0; k < 180; ++k) ranges[static_cast<std::size_t>(i)].push_back(static_cast<float>(range(generator)));
    scans.push_back(ScanOf(ranges[static_cast<std::size_t>(i)]));
    scans.back().T_map_laser.translation.x() += 0.1 * i;
    keyframes.back().epoch = scans.back().epoch = i / 3;
  }
  MapBuilder changed{MapBuilderOptions{}}, fresh{MapBuilderOptions{}};
  for (std::size_t i = 0; i < 12; ++i) {
    changed.InsertPoints(keyframes[i]);
    changed.InsertScan(scans[i]);
    changed.MarkFootprint({0.1 * static_cast<double>(i), 0.0});
  }
  for (std::size_t i = 1; i < 12; i += 2) {
    changed.RemoveScan(scans[i]);
    changed.RemovePoints(keyframes[i]);
    changed.UnmarkFootprint({0.1 * static_cast<double>(i), 0.0});
  }
  for (std::size_t i = 0; i < 12; i += 2) {
    fresh.MarkFootprint({0.1 * static_cast<double>(i), 0.0});
    fresh.InsertScan(scans[i]);
    fresh.InsertPoints(keyframes[i]);
  }
  ExpectSame(changed.Grid(), fresh.Grid());
  EXPECT_EQ(changed.VoxelCount(), fresh.VoxelCount());
}

TEST(MapBuilder, RemovedEpochLeavesTheOthers) {
  const std::vector<float> near(90, 2.0F), far(90, 3.0F);
  PosedScan first = ScanOf(near), second = ScanOf(far);
  second.epoch = 1;
  PosedPoints points = SeenFrom({0.0, 0.0, 1.1}, {{1.0, 0.5, 0.6}, {1.5, -0.5, 0.4}});
  MapBuilder changed{MapBuilderOptions{}}, fresh{MapBuilderOptions{}};
  changed.InsertScan(first);
  changed.InsertPoints(points);
  changed.InsertScan(second);
  changed.RemoveEpoch(0);
  changed.RemoveEpoch(7);  // nothing is in there
  fresh.InsertScan(second);
  ExpectSame(changed.Grid(), fresh.Grid());
  EXPECT_EQ(changed.VoxelCount(), fresh.VoxelCount());
}

TEST(MapBuilder, RangesThatAreNoNumbersSayNothing) {
  const std::vector<float> ranges(90, std::numeric_limits<float>::quiet_NaN());
  MapBuilder builder{MapBuilderOptions{}};
  builder.InsertScan(ScanOf(ranges));
  EXPECT_EQ(builder.VoxelCount(), 0U);
}

// The cells of a level scan are found another way than those of rays in space; both have to see the same.
TEST(MapBuilder, LevelBeamsSeeWhatTheSameBeamsSeeInSpace) {
  std::mt19937 generator(4);
  std::uniform_real_distribution<float> range(0.3F, 6.0F);
  std::vector<float> ranges(360);
  for (float& r : ranges) r = range(generator);
  PosedScan level = ScanOf(ranges);
  level.T_map_laser.translation.head<2>() << 0.0137, -0.0211;  // off the corners of cells
  PosedScan in_space = level;
  level.level_height = in_space.T_map_laser.translation.z();
  in_space.level_height.reset();
  MapBuilder one{MapBuilderOptions{}}, other{MapBuilderOptions{}};
  one.InsertScan(level);
  other.InsertScan(in_space);
  const auto difference = static_cast<long>(one.VoxelCount()) - static_cast<long>(other.VoxelCount());
  EXPECT_LE(std::abs(difference), 5) << "beams through a corner of four cells may take either way";
}

TEST(MapBuilder, PointsOfUnsureDepthOnlyClear) {
  PosedPoints points = SeenFrom({0.0, 0.0, 1.1}, {{2.0, 0.0, 0.6}});
  MapBuilderOptions options;
  points.points[0].depth_sigma = 1.1 * options.visual_hit_sigma;
  MapBuilder builder{options};
  for (int i = 0; i < 50; ++i) builder.InsertPoints(points);
  const OccupancyGrid2d grid = builder.Grid();
  EXPECT_EQ(std::count(grid.cells.begin(), grid.cells.end(), 100), 0);
  EXPECT_GT(std::count(grid.cells.begin(), grid.cells.end(), 0), 10);
}

TEST(MapBuilder, PointsThatDoNotBlockClearAllTheSame) {
  PosedPoints points = SeenFrom({0.0, 0.0, 1.1}, {{2.0, 0.0, 0.6}});
  MapBuilder blocked{MapBuilderOptions{}}, cleared{MapBuilderOptions{}};
  for (int i = 0; i < 50; ++i) blocked.InsertPoints(points);
  points.points[0].blocks = false;
  for (int i = 0; i < 50; ++i) cleared.InsertPoints(points);
  const OccupancyGrid2d with = blocked.Grid(), without = cleared.Grid();
  EXPECT_EQ(std::count(with.cells.begin(), with.cells.end(), 100), 1);
  EXPECT_EQ(std::count(without.cells.begin(), without.cells.end(), 100), 0);
  EXPECT_EQ(std::count(with.cells.begin(), with.cells.end(), 0),
            std::count(without.cells.begin(), without.cells.end(), 0));
}

TEST(MapBuilder, WhatLiesOutsideTheLatticeIsIgnored) {
  MapBuilder builder{MapBuilderOptions{}};
  builder.InsertPoints(SeenFrom({1e5, 0.0, 1.0}, {{1e5 + 1.0, 0.0, 1.0}}));
  builder.MarkFootprint({1e9, 0.0});
  EXPECT_EQ(builder.VoxelCount(), 0U);
  EXPECT_TRUE(builder.Grid().cells.empty());
}

TEST(MapBuilder, GridLiesOnMultiplesOfTheResolution) {
  MapBuilder builder{MapBuilderOptions{}};
  builder.MarkFootprint({-1.234, 5.678});
  const OccupancyGrid2d grid = builder.Grid();
  const Eigen::Vector2d cells = grid.origin / grid.resolution;
  EXPECT_NEAR(cells.x(), std::round(cells.x()), 1e-9);
  EXPECT_NEAR(cells.y(), std::round(cells.y()), 1e-9);
}

TEST(MapBuilderOptions, DefaultsAreSoundAndEachBadFieldIsNamed) {
  EXPECT_TRUE(MapBuilderOptions{}.Problems().empty());
  const auto expect_problem = [](const std::string& field, const std::function<void(MapBuilderOptions&)>& spoil) {
    MapBuilderOptions options;
    spoil(options);
    const std::vector<std::string> problems = options.Problems();
    ASSERT_EQ(problems.size(), 1U) << field;
    EXPECT_NE(problems[0].find(field), std::string::npos) << problems[0];
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect_problem("resolution", [](auto& o) { o.resolution = 0.0; });
  expect_problem("resolution", [&](auto& o) { o.resolution = nan; });
  expect_problem("visual_p_hit", [](auto& o) { o.visual.p_hit = 0.4; });
  expect_problem("visual_p_miss", [](auto& o) { o.visual.p_miss = 0.6; });
  expect_problem("laser_p_hit", [](auto& o) { o.laser.p_hit = 1.0; });
  expect_problem("laser_p_miss", [](auto& o) { o.laser.p_miss = 0.0; });
  expect_problem("clamp_min", [](auto& o) { o.clamp_min = 0.4; });
  expect_problem("clamp_max", [](auto& o) { o.clamp_max = 0.6; });
  expect_problem("visual_range", [](auto& o) { o.visual_range = -1.0; });
  expect_problem("laser_range", [&](auto& o) { o.laser_range = nan; });
  expect_problem("floor_tolerance", [](auto& o) { o.floor_tolerance = -0.1; });
  expect_problem("band_min", [](auto& o) { o.band_min = 1.5; });
  expect_problem("footprint_radius", [](auto& o) { o.footprint_radius = -0.1; });
}

}  // namespace
}  // namespace planar_vslam
