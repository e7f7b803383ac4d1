#include "planar_vslam/mapping2d/grid_score.h"

#include <gtest/gtest.h>

#include <random>

namespace planar_vslam {
namespace {

// Rows from the top as one draws them: '#' occupied, '.' free, ' ' unknown; 1 m cells from the origin.
OccupancyGrid2d Draw(const std::vector<std::string>& rows) {
  OccupancyGrid2d grid;
  grid.resolution = 1.0;
  grid.width = static_cast<int>(rows.front().size());
  grid.height = static_cast<int>(rows.size());
  for (auto row = rows.rbegin(); row != rows.rend(); ++row) {
    for (const char c : *row) grid.cells.push_back(static_cast<std::int8_t>(c == '#' ? 100 : (c == '.' ? 0 : -1)));
  }
  return grid;
}

GridScore Score(const OccupancyGrid2d& estimate, const OccupancyGrid2d& truth) {
  return ScoreGrid(estimate, truth, Rigid2(), {}, {});
}

TEST(GridScore, AGridAgreesWithItself) {
  std::mt19937 generator(1);
  std::discrete_distribution<int> kind({2.0, 5.0, 3.0});
  OccupancyGrid2d grid{40, 30, 0.05, {-1.0, 0.5}, {}};
  for (int i = 0; i < 40 * 30; ++i)
    grid.cells.push_back(
        static_cast<std::int8_t>(std::vector<int>{-1, 0, 100}[static_cast<std::size_t>(kind(generator))]));
  const GridScore score = Score(grid, grid);
  EXPECT_EQ(score.iou, 1.0);
  EXPECT_EQ(score.precision, 1.0);
  EXPECT_EQ(score.recall, 1.0);
  EXPECT_EQ(score.known, 1.0);
  EXPECT_EQ(score.wrong_free, 0.0);
  EXPECT_EQ(score.wrong_occupied, 0.0);
}

TEST(GridScore, CountsByHand) {
  const OccupancyGrid2d truth = Draw({"........",  //
                                      "...##...",  //
                                      "........"});
  const OccupancyGrid2d estimate = Draw({"#......#",  //
                                         "....#.. ",  //
                                         "...#...."});
  const GridScore score = Score(estimate, truth);
  EXPECT_EQ(score.our_occupied, 4);
  EXPECT_EQ(score.our_free, 19);
  EXPECT_EQ(score.truth_surface, 2);
  EXPECT_EQ(score.truth_reachable_free, 22);
  EXPECT_DOUBLE_EQ(score.iou, 1.0 / 5.0);        // (4, 1) of that, (3, 1) and our other three
  EXPECT_DOUBLE_EQ(score.precision, 2.0 / 4.0);  // the two corners are 3 cells away
  EXPECT_DOUBLE_EQ(score.recall, 1.0);
  EXPECT_DOUBLE_EQ(score.wrong_occupied, 0.0);  // within 3 cells
  EXPECT_DOUBLE_EQ(score.wrong_free, 0.0);      // (3, 1) has free neighbours
  EXPECT_DOUBLE_EQ(score.known, 21.0 / 22.0);
}

TEST(GridScore, OccupiedFarFromAnythingIsWrong) {
  const GridScore score = Score(Draw({"#...#...."}), Draw({"#........"}));
  EXPECT_DOUBLE_EQ(score.wrong_occupied, 1.0 / 2.0);
}

TEST(GridScore, FreeInsideAnObstacleIsWrong) {
  const OccupancyGrid2d truth = Draw({".....", "#####", "#####", "#####", "....."});
  const OccupancyGrid2d estimate = Draw({".....", ".....", ".....", ".....", "....."});
  EXPECT_DOUBLE_EQ(Score(estimate, truth).wrong_free, 5.0 / 25.0);  // the middle row
  const GridScore strict = ScoreGrid(estimate, truth, Rigid2(), {}, {0});
  EXPECT_DOUBLE_EQ(strict.wrong_free, 15.0 / 25.0);
}

TEST(GridScore, OnlySurfacesCountForRecall) {
  const OccupancyGrid2d truth = Draw({"#####", "#####", "#####", "....."});
  const OccupancyGrid2d estimate = Draw({"     ", "     ", "##   ", "     "});
  const GridScore score = Score(estimate, truth);
  EXPECT_EQ(score.truth_surface, 5);
  EXPECT_DOUBLE_EQ(score.recall, 3.0 / 5.0);  // (0, 1), (1, 1) and their neighbour
}

TEST(GridScore, DiagonalFreeCellsMakeNoSurface) { EXPECT_EQ(Score(Draw({"#."}), Draw({" .", "# "})).truth_surface, 0); }

TEST(GridScore, KnownAsksForWhatThePathReaches) {
  const OccupancyGrid2d truth = Draw({"...#..", "...#..", "...#.."});
  const OccupancyGrid2d estimate = Draw({"..    ", "...   ", "...   "});
  const GridScore left = ScoreGrid(estimate, truth, Rigid2(), {{0.5, 0.5}}, {});
  EXPECT_EQ(left.truth_reachable_free, 9);
  EXPECT_DOUBLE_EQ(left.known, 8.0 / 9.0);
  EXPECT_DOUBLE_EQ(ScoreGrid(estimate, truth, Rigid2(), {{4.5, 0.5}}, {}).known, 0.0);
  EXPECT_EQ(ScoreGrid(estimate, truth, Rigid2(), {}, {}).truth_reachable_free, 15);
  EXPECT_EQ(ScoreGrid(estimate, truth, Rigid2(), {{3.5, 0.5}, {-9.0, 0.0}}, {}).truth_reachable_free, 0)
      << "a path inside an obstacle or outside the grid reaches nothing";
}

TEST(GridScore, WhatIsBehindAnotherThingIsNotInSight) {
  const OccupancyGrid2d truth = Draw({"#########",  //
                                      "#...#...#",  //
                                      "#.......#",  // the lower half of the right wall is behind...
                                      "#...##..#",  // ...this
                                      "#...##..#",  //
                                      "#########"});
  GridScoreOptions exact{0, 20.0};
  const GridScore all = ScoreGrid(truth, truth, Rigid2(), {}, exact);
  EXPECT_EQ(all.in_sight, 1.0) << "without a path all counts";
  const GridScore left = ScoreGrid(truth, truth, Rigid2(), {{1.5, 1.5}}, exact);
  EXPECT_EQ(left.recall, 1.0);
  EXPECT_LT(left.in_sight, 0.8);
  EXPECT_GT(left.in_sight, 0.4);
  const GridScore both = ScoreGrid(truth, truth, Rigid2(), {{1.5, 1.5}, {6.5, 1.5}}, exact);
  EXPECT_GT(both.in_sight, left.in_sight);
  exact.sight_range = 1.0;
  EXPECT_LT(ScoreGrid(truth, truth, Rigid2(), {{1.5, 1.5}}, exact).in_sight, left.in_sight);
}

TEST(GridScore, FreeSpaceIsReachedDiagonally) {
  EXPECT_EQ(ScoreGrid(Draw({".."}), Draw({"#.", ".#"}), Rigid2(), {{0.5, 0.5}}, {}).truth_reachable_free, 2);
}

TEST(GridScore, TransformBringsTheEstimateToTheTruth) {
  const OccupancyGrid2d truth = Draw({"...##", ".....", "#...."});
  // The truth as seen from a frame at (5, 0) that is turned by a quarter.
  const Rigid2 T_truth_estimate(5.0, 0.0, M_PI_2);
  const OccupancyGrid2d estimate = Draw({"#..", "...", "...", "..#", "..#"});
  const GridScore score = ScoreGrid(estimate, truth, T_truth_estimate, {}, {0});
  EXPECT_EQ(score.iou, 1.0);
  EXPECT_EQ(score.known, 1.0);
}

TEST(GridScore, CoarserEstimateIsReadUnderTheTruthsCellCentres) {
  const OccupancyGrid2d truth = Draw({"..##", "..##"});
  OccupancyGrid2d estimate = Draw({".#"});
  estimate.resolution = 2.0;
  EXPECT_EQ(ScoreGrid(estimate, truth, Rigid2(), {}, {0}).iou, 1.0);
}

TEST(GridScore, NothingToDivideByGivesZero) {
  const OccupancyGrid2d unknown = Draw({"  "});
  const GridScore score = Score(OccupancyGrid2d{}, unknown);
  for (const double share :
       {score.iou, score.precision, score.recall, score.wrong_free, score.wrong_occupied, score.known}) {
    EXPECT_EQ(share, 0.0);
  }
}

}  // namespace
}  // namespace planar_vslam
