// Scans into the navigation map, beside OctoMap's own ray by ray, and the price of a loop closure. The laser stands in
// made-up rooms: 541 beams over 270 degrees, 8 m, cells of 5 cm.
#include <benchmark/benchmark.h>
#include <octomap/octomap.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "planar_vslam/mapping2d/map_builder.h"

namespace planar_vslam {
namespace {

constexpr int kBeams = 541;
constexpr double kStep = DegreesToRadians(0.5);
constexpr double kFirst = DegreesToRadians(-135.0);
constexpr double kRange = 8.0;       // m
constexpr double kHeight = 0.25;     // m
constexpr double kRoom = 6.0;        // m, half the side of the room
constexpr double kPillarGrid = 3.0;  // m between round pillars
constexpr double kPillar = 0.2;      // m, their radius

// Distance to the room's walls and pillars, infinity beyond the laser's range.
float Measure(const Eigen::Vector2d& from, double angle) {
  const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
  double nearest = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 2; ++axis) {
    const double wall = direction[axis] > 0.0 ? kRoom : -kRoom;
    if (direction[axis] != 0.0) nearest = std::min(nearest, (wall - from[axis]) / direction[axis]);
  }
  for (double x = -kPillarGrid; x <= kPillarGrid; x += kPillarGrid) {
    for (double y = -kPillarGrid; y <= kPillarGrid; y += kPillarGrid) {
      const Eigen::Vector2d to = Eigen::Vector2d(x, y) - from;
      const double along = to.dot(direction), across2 = to.squaredNorm() - along * along;
      if (along > 0.0 && across2 < kPillar * kPillar)
        nearest = std::min(nearest, along - std::sqrt(kPillar * kPillar - across2));
    }
  }
  return nearest < kRange ? static_cast<float>(nearest) : std::numeric_limits<float>::infinity();
}

struct Sweep {
  Rigid2 T_map_laser;
  std::vector<float> ranges;
};

// A drive in a circle between the pillars.
std::vector<Sweep> Drive(int count) {
  constexpr double kRadius = 1.7;  // m
  std::vector<Sweep> sweeps;
  for (int i = 0; i < count; ++i) {
    const double turn = 2.0 * M_PI * i / count;
    Sweep sweep;
    sweep.T_map_laser = Rigid2(kRadius * std::cos(turn), kRadius * std::sin(turn), turn + M_PI_2);
    for (int beam = 0; beam < kBeams; ++beam) {
      sweep.ranges.push_back(Measure(sweep.T_map_laser.translation, sweep.T_map_laser.angle + kFirst + beam * kStep));
    }
    sweeps.push_back(std::move(sweep));
  }
  return sweeps;
}

PosedScan ScanOf(const Sweep& sweep, const Rigid2& T_new_old, int epoch) {
  PosedScan scan;
  scan.T_map_laser = Embed3(T_new_old * sweep.T_map_laser);
  scan.angle_min = kFirst;
  scan.angle_increment = kStep;
  scan.range_max = kRange;
  scan.ranges = &sweep.ranges;
  scan.level_height = kHeight;
  scan.epoch = epoch;
  return scan;
}

void InsertScan(benchmark::State& state) {
  const std::vector<Sweep> sweeps = Drive(200);
  std::size_t bytes = 0;
  for (auto _ : state) {
    MapBuilder builder{MapBuilderOptions{}};
    for (const Sweep& sweep : sweeps) builder.InsertScan(ScanOf(sweep, Rigid2(), 0));
    bytes = builder.MemoryBytes();
  }
  state.counters["scans_per_second"] =
      benchmark::Counter(200.0 * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
  state.counters["bytes_per_m2"] = static_cast<double>(bytes) / (4.0 * kRoom * kRoom);
}
BENCHMARK(InsertScan)->Unit(benchmark::kMillisecond);

void OctomapInsertPointCloud(benchmark::State& state) {
  const std::vector<Sweep> sweeps = Drive(200);
  std::size_t bytes = 0;
  for (auto _ : state) {
    octomap::OcTree tree(0.05);
    for (const Sweep& sweep : sweeps) {
      octomap::Pointcloud cloud;
      for (int beam = 0; beam < kBeams; ++beam) {
        const double angle = sweep.T_map_laser.angle + kFirst + beam * kStep;
        // Beyond the range given below a beam clears only, as those without return do.
        const float range = sweep.ranges[static_cast<std::size_t>(beam)];
        const double length = std::isfinite(range) ? range : kRange + 1.0;
        const Eigen::Vector2d end =
            sweep.T_map_laser.translation + length * Eigen::Vector2d(std::cos(angle), std::sin(angle));
        cloud.push_back(static_cast<float>(end.x()), static_cast<float>(end.y()), static_cast<float>(kHeight));
      }
      const octomap::point3d origin(static_cast<float>(sweep.T_map_laser.translation.x()),
                                    static_cast<float>(sweep.T_map_laser.translation.y()), static_cast<float>(kHeight));
      tree.insertPointCloud(cloud, origin, kRange, /*lazy_eval=*/state.range(0) != 0);
    }
    bytes = tree.memoryUsage();
  }
  state.counters["scans_per_second"] =
      benchmark::Counter(200.0 * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
  state.counters["bytes_per_m2"] = static_cast<double>(bytes) / (4.0 * kRoom * kRoom);
}
BENCHMARK(OctomapInsertPointCloud)->ArgName("lazy")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

// 300 keyframes of the argument's number of scans each move: the half of the map that a loop closure bends. The other
// 300 stay. As pipeline::NavigationMap does it: where most of an epoch moves, the epoch starts over. The grid is read,
// too.
void LoopClosure(benchmark::State& state) {
  constexpr int kKeyframes = 600, kMoved = 300, kInEpoch = 16;
  const int each = static_cast<int>(state.range(0));
  const std::vector<Sweep> sweeps = Drive(kKeyframes * each);
  MapBuilder builder{MapBuilderOptions{}};
  const auto epoch = [&](int i) { return i / each / kInEpoch; };
  const auto scan = [&](int i, const Rigid2& T_new_old) {
    return ScanOf(sweeps[static_cast<std::size_t>(i)], T_new_old, epoch(i));
  };
  for (int i = 0; i < kKeyframes * each; ++i) builder.InsertScan(scan(i, Rigid2()));
  std::array<Rigid2, 2> T_new_old = {Rigid2(), Rigid2(0.2, -0.1, 0.02)};
  for (auto _ : state) {
    const int last = epoch(kMoved * each - 1), end = (last + 1) * kInEpoch * each;
    for (int e = 0; e <= last; ++e) builder.RemoveEpoch(e);
    for (int i = 0; i < end; ++i) builder.InsertScan(scan(i, i < kMoved * each ? T_new_old[1] : Rigid2()));
    std::swap(T_new_old[0], T_new_old[1]);
    benchmark::DoNotOptimize(builder.Grid());
  }
}
BENCHMARK(LoopClosure)->ArgName("scans")->Arg(1)->Arg(3)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace planar_vslam
