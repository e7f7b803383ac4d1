// Rays into the occupancy layers: a laser sweep in a square room of the given half width in metres, and the grid made
// of what they left.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>

#include "planar_vslam/mapping2d/map_builder.h"

namespace planar_vslam {
namespace {

constexpr int kBeams = 360;
constexpr double kIncrement = 2.0 * M_PI / kBeams;  // rad

std::vector<float> SweepOfRoom(double half_width) {
  std::vector<float> ranges;
  for (int i = 0; i < kBeams; ++i) {
    const double angle = -M_PI + kIncrement * i;
    ranges.push_back(static_cast<float>(half_width / std::max(std::abs(std::cos(angle)), std::abs(std::sin(angle)))));
  }
  return ranges;
}

PosedScan ScanWith(const std::vector<float>& ranges) {
  PosedScan scan;
  scan.T_map_laser = Rigid3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.01, 0.02, 0.3));
  scan.angle_min = -M_PI;
  scan.angle_increment = kIncrement;
  scan.range_min = 0.05;
  scan.range_max = 10.0;
  scan.ranges = &ranges;
  return scan;
}

// Into a map that knows the room: what all sweeps but the first ones meet.
void InsertScan(benchmark::State& state) {
  const std::vector<float> ranges = SweepOfRoom(static_cast<double>(state.range(0)));
  const PosedScan scan = ScanWith(ranges);
  MapBuilder builder(MapBuilderOptions{});
  builder.InsertScan(scan);
  for (auto _ : state) builder.InsertScan(scan);
  state.SetItemsProcessed(state.iterations() * kBeams);  // rays
  state.counters["voxels"] = static_cast<double>(builder.VoxelCount());
}
BENCHMARK(InsertScan)->Arg(2)->Arg(5)->Unit(benchmark::kMicrosecond);

void MakeGrid(benchmark::State& state) {
  const std::vector<float> ranges = SweepOfRoom(static_cast<double>(state.range(0)));
  MapBuilder builder(MapBuilderOptions{});
  for (int i = 0; i < 3; ++i) builder.InsertScan(ScanWith(ranges));
  for (auto _ : state) benchmark::DoNotOptimize(builder.Grid());
}
BENCHMARK(MakeGrid)->Arg(2)->Arg(5)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace planar_vslam
