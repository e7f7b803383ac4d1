// A table top that the laser passes below: the map has it from points that the camera saw, and the robot drives round
// it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "planar_vslam/mapping2d/map_builder.h"
#include "plane.h"

namespace planar_vslam::test {
namespace {

constexpr double kLength = 8.0, kWidth = 5.0, kWall = 0.05;  // m: the room, its walls
const Eigen::Vector2d kLow(3.4, 2.1), kHigh(4.6, 2.9);       // m: corners of the table top

// Points on the table top, as landmarks lie there.
std::vector<Eigen::Vector3d> PointsOnTable() {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 120; ++i) {
    const auto spread = [i](double irrational) { return std::fmod(i * irrational, 1.0); };
    points.emplace_back(kLow.x() + (kHigh.x() - kLow.x()) * spread(M_SQRT2),
                        kLow.y() + (kHigh.y() - kLow.y()) * spread(std::sqrt(3.0)),
                        0.74 + 0.01 * spread(std::sqrt(5.0)));
  }
  return points;
}

// A sweep all round, 0.25 m above the floor: nothing but walls.
void InsertSweep(const Eigen::Vector2d& at, MapBuilder* builder) {
  constexpr int kBeams = 720;
  PosedScan scan;
  scan.T_map_laser = Embed3(Rigid2(at, 0.0));
  scan.T_map_laser.translation.z() = 0.25;
  scan.angle_increment = 2.0 * M_PI / kBeams;
  scan.range_max = 12.0;
  std::vector<float> ranges;
  for (int i = 0; i < kBeams; ++i) {
    const double c = std::cos(i * scan.angle_increment), s = std::sin(i * scan.angle_increment);
    const double x = ((c > 0.0 ? kLength - kWall : kWall) - at.x()) / (std::abs(c) > 1e-9 ? c : 1e-9);
    const double y = ((s > 0.0 ? kWidth - kWall : kWall) - at.y()) / (std::abs(s) > 1e-9 ? s : 1e-9);
    ranges.push_back(static_cast<float>(std::min(std::abs(x), std::abs(y))));
  }
  scan.ranges = &ranges;
  builder->InsertScan(scan);
}

OccupancyGrid2d MapOfRoom(bool with_table) {
  MapBuilder builder{MapBuilderOptions()};
  for (const double x : {1.0, 2.5, 4.0, 5.5, 7.0}) {
    for (const double y : {1.0, 2.5, 4.0}) {
      for (int i = 0; i < 3; ++i) InsertSweep({x, y}, &builder);
    }
  }
  if (with_table) builder.SetOverhangs(FindOverhangs(PointsOnTable(), OverhangOptions()));
  return builder.Grid();
}

// How near the body came to what stands below the table top's outline, m; negative: below it.
double LeastDistance(const OccupancyGrid2d& map, NavigatorOutput* output) {
  const NavigateOptions options;
  Plane plane(options, map, Room(kLength, kWidth), Rigid2(1.0, 2.5, 0.0));
  plane.navigator.SetGoal(Rigid2(7.0, 2.5, 0.0));
  double least = 1e9;
  while (plane.time < 90.0) {
    *output = plane.Step();
    const Eigen::Vector2d& at = plane.T_map_base.translation;
    least = std::min(least, (at.cwiseMax(kLow).cwiseMin(kHigh) - at).norm() - options.robot_radius);
    if (output->state != GoalState::kDriving) break;
  }
  return least;
}

TEST(TableTop, IsDrivenRound) {
  NavigatorOutput output;
  EXPECT_GT(LeastDistance(MapOfRoom(true), &output), 0.0);
  EXPECT_EQ(output.state, GoalState::kReached) << output.text;
}

TEST(TableTop, IsNothingToTheLaserAlone) {
  NavigatorOutput output;
  EXPECT_LT(LeastDistance(MapOfRoom(false), &output), -0.2) << "else the test above says nothing";
  EXPECT_EQ(output.state, GoalState::kReached) << output.text;
}

}  // namespace
}  // namespace planar_vslam::test
