// Residuals and Jacobians of every factor beside those of its automatically differentiated twin
// (test/support/factor_twins.h). Both run in turns and all times are CPU times, so that `slower`, how many times longer
// the twin takes, depends little on what else the machine does; `automatic_ns` is the twin's time.
#include <benchmark/benchmark.h>
#include <ceres/ceres.h>

#include <array>
#include <ctime>

#include "planar_vslam/optimize/planar_reprojection_factor.h"
#include "planar_vslam/optimize/reprojection_factor.h"
#include "planar_vslam/planar/planar_prior.h"
#include "planar_vslam/planar/pose_manifold.h"
#include "planar_vslam/planar/preintegration.h"
#include "planar_vslam/planar/relative_pose_factor.h"
#include "support/factor_twins.h"

namespace planar_vslam {
namespace {

using test::OdometryTwin;
using test::PlanarPriorTwin;
using test::PlanarReprojectionTwin;
using test::ReprojectionTwin;

constexpr int kBatch = 4096;  // evaluations between two looks at the clock, which counts microseconds

// A pose, or a point in the first three entries.
using Block = std::array<double, kPoseBlockSize>;

Block ToBlock(const Rigid3& T) {
  Block block;
  StorePose(T, block.data());
  return block;
}

double SecondsOfBatch(const ceres::CostFunction& cost, const std::array<Block, 2>& blocks) {
  constexpr std::size_t kMostEntries = 6 * kPoseBlockSize;
  std::array<double, 6> residuals;
  std::array<std::array<double, kMostEntries>, 2> J;
  const double* parameters[] = {blocks[0].data(), blocks[1].data()};
  double* jacobians[] = {J[0].data(), J[1].data()};
  const std::clock_t start = std::clock();
  for (int i = 0; i < kBatch; ++i) {
    cost.Evaluate(parameters, residuals.data(), jacobians);
    benchmark::DoNotOptimize(residuals);
    benchmark::DoNotOptimize(J);
  }
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

void Compare(benchmark::State& state, const ceres::CostFunction& analytic, const ceres::CostFunction& automatic,
             const std::array<Block, 2>& blocks) {
  double analytic_seconds = 0.0, automatic_seconds = 0.0;
  while (state.KeepRunningBatch(kBatch)) {
    const double seconds = SecondsOfBatch(analytic, blocks);
    state.SetIterationTime(seconds);
    analytic_seconds += seconds;
    automatic_seconds += SecondsOfBatch(automatic, blocks);
  }
  constexpr double kNanosecondsPerSecond = 1e9;
  state.counters["automatic_ns"] = kNanosecondsPerSecond * automatic_seconds / static_cast<double>(state.iterations());
  state.counters["slower"] = automatic_seconds / analytic_seconds;
}

Rigid3 Pose(double x, double y, double angle) { return Embed3(Rigid2(x, y, angle)); }

// A point seen from the floor.
struct View {
  static constexpr double kF = 600.0, kCx = 320.0, kCy = 240.0, kSigma = 1.2;  // px
  Rigid3 T_map_base = Pose(1.0, -2.0, 0.7);
  Rigid3 T_base_camera{Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), Eigen::Vector3d(0.1, 0.0, 1.0)};
  Eigen::Vector3d p_map = T_map_base * T_base_camera * Eigen::Vector3d(0.4, -0.3, 3.0);
  Eigen::Vector2d pixel{400.0, 180.0};
  ReprojectionFactor factor{pixel, T_base_camera, kF, kF, kCx, kCy, kSigma};
  ReprojectionTwin twin{pixel, T_base_camera.Inverse(), kF, kF, kCx, kCy, kSigma};
  std::array<Block, 2> blocks{ToBlock(T_map_base), Block{p_map.x(), p_map.y(), p_map.z()}};
};

void Reprojection(benchmark::State& state) {
  const View view;
  const ceres::AutoDiffCostFunction<ReprojectionTwin, 2, 7, 3> automatic(new ReprojectionTwin(view.twin));
  Compare(state, view.factor, automatic, view.blocks);
}
BENCHMARK(Reprojection)->UseManualTime();

Eigen::Matrix2d Whitening(const View& view) {
  const PlanarPriorOptions options;
  return FloorWhitening(view.factor, view.blocks[0].data(), view.blocks[1].data(), options.sigma_height,
                        options.sigma_tilt);
}

void PlanarReprojection(benchmark::State& state) {
  const View view;
  const Eigen::Matrix2d W = Whitening(view);
  const PlanarReprojectionFactor analytic(view.factor, W);
  const ceres::AutoDiffCostFunction<PlanarReprojectionTwin, 2, 7, 3> automatic(
      new PlanarReprojectionTwin{view.twin, W});
  Compare(state, analytic, automatic, view.blocks);
}
BENCHMARK(PlanarReprojection)->UseManualTime();

// What a round of se2_xyz pays an observation for its weight.
void FloorWhiteningOfAPoint(benchmark::State& state) {
  const View view;
  for (auto _ : state) benchmark::DoNotOptimize(Whitening(view));
}
BENCHMARK(FloorWhiteningOfAPoint);

void OdometrySe3(benchmark::State& state) {
  PlanarMotion odometry;
  odometry.T_i_j = Rigid2(0.4, 0.1, 0.3);
  odometry.covariance.diagonal() << 4e-4, 6e-4, 3e-4;
  odometry.distance = 0.5;
  const Matrix6d S = SquareRootInformation(LiftedCovariance(odometry, OdometryNoise()));
  const Rigid3 T_i_j = Embed3(odometry.T_i_j);
  const RelativePoseFactor<6> analytic(T_i_j, S);
  const ceres::AutoDiffCostFunction<OdometryTwin, 6, 7, 7> automatic(new OdometryTwin{T_i_j, S});
  Compare(state, analytic, automatic, {ToBlock(Pose(1.0, -2.0, 3.0)), ToBlock(Pose(0.6, -2.1, -2.9))});
}
BENCHMARK(OdometrySe3)->UseManualTime();

void FloorPrior(benchmark::State& state) {
  const PlanarPriorOptions options;
  const PlanarPriorFactor analytic(FloorSigmasOf(options, true));
  const ceres::AutoDiffCostFunction<PlanarPriorTwin, 3, 7> automatic(
      new PlanarPriorTwin{options.sigma_height, options.sigma_tilt});
  const Vector6d tilted = (Vector6d() << 0.0, 0.0, 0.01, 0.02, -0.01, 0.0).finished();
  Compare(state, analytic, automatic, {ToBlock(Pose(1.0, -2.0, 0.7) * ExpSe3(tilted)), Block()});
}
BENCHMARK(FloorPrior)->UseManualTime();

}  // namespace
}  // namespace planar_vslam
