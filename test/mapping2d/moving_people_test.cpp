// A person walks to and fro in a room while the robot drives on, and leaves.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "planar_vslam/mapping2d/map_builder.h"

namespace planar_vslam {
namespace {

constexpr double kRoom = 3.5;           // m, half its side
constexpr double kPersonRadius = 0.15;  // m, at the laser's height
constexpr double kWalk = 2.0;           // m, half the way to and fro
constexpr double kSpeed = 1.0;          // m/s
constexpr double kScanInterval = 0.2;   // s
constexpr double kLeaves = 30.0;        // s
constexpr double kEnds = 60.0;          // s
constexpr double kEpoch = 10.0;         // s

Eigen::Vector2d PersonAt(double t) {
  const double phase = std::fmod(kSpeed * t, 4.0 * kWalk);
  return {1.0, phase < 2.0 * kWalk ? phase - kWalk : 3.0 * kWalk - phase};
}

float Measure(const Eigen::Vector2d& from, double angle, const Eigen::Vector2d* person) {
  const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
  double nearest = 1e9;
  for (int axis = 0; axis < 2; ++axis) {
    if (std::abs(direction[axis]) < 1e-9) continue;
    nearest = std::min(nearest, (std::copysign(kRoom, direction[axis]) - from[axis]) / direction[axis]);
  }
  if (person != nullptr) {
    const Eigen::Vector2d to = *person - from;
    const double along = to.dot(direction), across2 = to.squaredNorm() - along * along;
    if (along > 0.0 && across2 < kPersonRadius * kPersonRadius)
      nearest = std::min(nearest, along - std::sqrt(kPersonRadius * kPersonRadius - across2));
  }
  return static_cast<float>(nearest);
}

TEST(MovingPeople, DoNotStayInTheMap) {
  MapBuilder builder{MapBuilderOptions{}};
  std::set<std::pair<int, int>> walked;  // cells, of 5 cm
  for (double t = 0.0; t < kEnds; t += kScanInterval) {
    const Eigen::Vector2d person = PersonAt(t), robot(-1.5 + 0.5 * std::cos(0.4 * t), 0.5 * std::sin(0.4 * t));
    std::vector<float> ranges;
    for (int i = 0; i < 720; ++i)
      ranges.push_back(Measure(robot, DegreesToRadians(0.5 * i), t < kLeaves ? &person : nullptr));
    PosedScan scan;
    scan.T_map_laser = Embed3(Rigid2(robot, 0.0));
    scan.angle_increment = DegreesToRadians(0.5);
    scan.range_max = 8.0;
    scan.ranges = &ranges;
    scan.level_height = 0.25;
    scan.epoch = static_cast<int>(t / kEpoch);
    builder.InsertScan(scan);
    if (t >= kLeaves) continue;
    for (double x = -kPersonRadius; x <= kPersonRadius; x += 0.025) {
      for (double y = -kPersonRadius; y <= kPersonRadius; y += 0.025) {
        walked.emplace(static_cast<int>(std::floor((person.x() + x) / 0.05)),
                       static_cast<int>(std::floor((person.y() + y) / 0.05)));
      }
    }
  }
  const OccupancyGrid2d grid = builder.Grid();
  const auto column = static_cast<int>(std::lround(grid.origin.x() / 0.05));
  const auto row = static_cast<int>(std::lround(grid.origin.y() / 0.05));
  const long left = std::count_if(walked.begin(), walked.end(), [&](const std::pair<int, int>& cell) {
    return grid.At(cell.first - column, cell.second - row) == 100;
  });
  EXPECT_GT(walked.size(), 300U);
  EXPECT_LE(static_cast<double>(left), 0.01 * static_cast<double>(walked.size()));
  EXPECT_GT(std::count(grid.cells.begin(), grid.cells.end(), 100), 400) << "the walls stay";
}

}  // namespace
}  // namespace planar_vslam
