// The recorded laboratory: its scans at true poses, made as wrong as a good estimate is, against its true grids.
#include <gtest/gtest.h>

#include <cctype>
#include <cmath>
#include <fstream>
#include <random>
#include <sstream>

#include "planar_vslam/mapping2d/grid_score.h"
#include "planar_vslam/mapping2d/map_builder.h"
#include "support/support.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

constexpr double kLaserHeight = 0.25;     // m, calibration.yaml of the sequence
constexpr double kAngleMin = -2.35619;    // rad
constexpr double kBeamStep = 0.00872665;  // rad
constexpr double kRangeMax = 8.0;         // m
constexpr int kEveryScan = 5;             // a keyframe a second
constexpr double kEpoch = 15.0;           // s
constexpr double kPositionError = 0.03;   // m, of the estimate
constexpr double kHeadingError = DegreesToRadians(0.5);
constexpr double kErrorPeriod = 10.0;  // s over which the estimate's error changes

// Rows of numbers; comment lines start with something else.
std::vector<std::vector<double>> ReadRows(const fs::path& path, char separator) {
  std::vector<std::vector<double>> rows;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || std::isdigit(static_cast<unsigned char>(line[0])) == 0) continue;
    std::istringstream words(line);
    rows.emplace_back();
    for (std::string word; std::getline(words, word, separator);)
      rows.back().push_back(std::strtod(word.c_str(), nullptr));
  }
  return rows;
}

// The truth at the row nearest in time: at 10 Hz within 2.5 cm.
Rigid3 PoseAt(const std::vector<std::vector<double>>& rows, double t) {
  const auto* nearest = &rows.front();
  for (const auto& row : rows) {
    if (std::abs(row[0] - t) < std::abs((*nearest)[0] - t)) nearest = &row;
  }
  const auto& r = *nearest;
  return {Eigen::Quaterniond(r[7], r[4], r[5], r[6]).normalized(), Eigen::Vector3d(r[1], r[2], r[3])};
}

TEST(Lab, GridIsRightWhenPosesAreCentimetresWrong) {
  const auto folder = test::SequenceFolder("dev_lab");
  if (!folder) GTEST_SKIP() << "sequence dev_lab is not on this machine";
  const auto poses = ReadRows(*folder / "groundtruth_base.txt", ' ');
  const auto scans = ReadRows(*folder / "scan.csv", ',');
  ASSERT_FALSE(poses.empty() || scans.empty());

  std::mt19937 generator(1);
  std::normal_distribution<double> normal;
  const Eigen::Vector3d sigma(kPositionError / M_SQRT2, kPositionError / M_SQRT2, kHeadingError);
  Eigen::Vector3d error = Eigen::Vector3d::Zero();
  MapBuilder builder{MapBuilderOptions{}};
  std::vector<Eigen::Vector2d> path;
  double last_t = -1e9;
  for (std::size_t i = 0; i < scans.size(); i += kEveryScan) {
    const double t = scans[i][0], memory = std::exp(-(t - last_t) / kErrorPeriod);
    for (int k = 0; k < 3; ++k) error[k] = memory * error[k] + std::sqrt(1.0 - memory * memory) * normal(generator);
    const Rigid3 T_map_base = PoseAt(poses, t) * Embed3(ExpSe2(sigma.cwiseProduct(error)));
    const std::vector<float> ranges(scans[i].begin() + 1, scans[i].end());
    PosedScan scan;
    scan.T_map_laser = T_map_base * Rigid3(Eigen::Quaterniond::Identity(), {0.0, 0.0, kLaserHeight});
    scan.angle_min = kAngleMin;
    scan.angle_increment = kBeamStep;
    scan.range_max = kRangeMax;
    scan.ranges = &ranges;
    scan.level_height = kLaserHeight;
    scan.epoch = static_cast<int>(t / kEpoch);
    builder.InsertScan(scan);
    builder.MarkFootprint(T_map_base.translation.head<2>());
    path.emplace_back(PoseAt(poses, t).translation.head<2>());
    last_t = t;
  }
  const auto body = ReadMapServerFiles(*folder / "groundtruth_grid.yaml");
  const auto slice = ReadMapServerFiles(*folder / "groundtruth_grid_laser.yaml");
  ASSERT_TRUE(body.ok() && slice.ok());
  const OccupancyGrid2d grid = builder.Grid();
  const GridScore against_body = ScoreGrid(grid, *body, Rigid2(), path, {});
  const GridScore against_slice = ScoreGrid(grid, *slice, Rigid2(), path, {});
  EXPECT_GE(against_body.precision, 0.85);
  EXPECT_GE(against_slice.recall, 0.75);
  EXPECT_LE(against_slice.wrong_free, 0.005);
  EXPECT_GE(against_slice.known, 0.9);
}

}  // namespace
}  // namespace planar_vslam
