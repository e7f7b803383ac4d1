// Wheel odometry between two frames or keyframes: summing it up and turning it into a factor's weight.
#include <benchmark/benchmark.h>

#include "planar_vslam/planar/preintegration.h"

namespace planar_vslam {
namespace {

// A curve at 0.5 m/s and 0.5 rad/s, read at 100 Hz.
std::vector<OdometryReading> Readings(std::int64_t count) {
  constexpr double kPeriod = 0.01;  // s
  const Rigid2 step(0.5 * kPeriod, 0.0, 0.5 * kPeriod);
  std::vector<OdometryReading> readings;
  Rigid2 T_odom_base;
  for (std::int64_t i = 0; i < count; ++i) {
    readings.push_back({Timestamp::FromSeconds(kPeriod * static_cast<double>(i)), T_odom_base});
    T_odom_base = T_odom_base * step;
  }
  return readings;
}

void SumUp(benchmark::State& state) {
  const std::vector<OdometryReading> readings = Readings(state.range(0));
  const OdometryNoise noise;
  for (auto _ : state) benchmark::DoNotOptimize(Preintegrate(readings, noise));
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(SumUp)->Arg(4)->Arg(100);

void ComposeTwo(benchmark::State& state) {
  const PlanarMotion half = Preintegrate(Readings(50), OdometryNoise());
  for (auto _ : state) benchmark::DoNotOptimize(Compose(half, half));
}
BENCHMARK(ComposeTwo);

void FactorWeight(benchmark::State& state) {
  const OdometryNoise noise;
  const PlanarMotion odometry = Preintegrate(Readings(100), noise);
  for (auto _ : state) benchmark::DoNotOptimize(SquareRootInformation(LiftedCovariance(odometry, noise)));
}
BENCHMARK(FactorWeight);

}  // namespace
}  // namespace planar_vslam
