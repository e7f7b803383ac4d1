// The pose of one frame against fixed landmarks, from a start 10 cm and 3 degrees off, every tenth match wrong.
#include <benchmark/benchmark.h>

#include <random>

#include "planar_vslam/optimize/pose_only.h"

namespace planar_vslam {
namespace {

struct Frame {
  PoseOnlyProblem problem;
  std::vector<PoseObservation> observations;
};

Frame RandomFrame(std::int64_t points, PlanarMode floor) {
  Frame frame;
  CameraModel& camera = frame.problem.camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 600.0;
  camera.cx = 320.0;
  camera.cy = 240.0;
  const Rigid3 truth = Embed3(Rigid2(1.0, -2.0, 0.7));
  frame.problem.T_base_camera = Rigid3(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), Eigen::Vector3d(0.1, 0.0, 1.0));
  frame.problem.floor = floor;
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> u(0.0, camera.width), v(0.0, camera.height), depth(1.0, 6.0);
  std::normal_distribution<double> noise;
  for (std::int64_t i = 0; i < points; ++i) {
    const Eigen::Vector2d pixel(u(generator), v(generator));
    const Eigen::Vector3d p_camera = depth(generator) * camera.Ray(pixel);
    const bool is_wrong = i % 10 == 0;
    const Eigen::Vector2d seen = is_wrong
                                     ? Eigen::Vector2d(u(generator), v(generator))
                                     : Eigen::Vector2d(pixel + Eigen::Vector2d(noise(generator), noise(generator)));
    frame.observations.push_back({truth * frame.problem.T_base_camera * p_camera, seen, 1.0, true});
  }
  const Vector6d off = (Vector6d() << 0.1, -0.05, 0.0, 0.0, 0.0, DegreesToRadians(3.0)).finished();
  frame.problem.T_map_base = truth * ExpSe3(off);
  return frame;
}

void OptimizePoseOf(benchmark::State& state, PlanarMode floor) {
  const Frame frame = RandomFrame(state.range(0), floor);
  std::vector<PoseObservation> observations;
  int inliers = 0;
  for (auto _ : state) {
    observations = frame.observations;
    inliers = OptimizePose(frame.problem, &observations).inliers;
  }
  state.counters["inliers"] = inliers;
}
BENCHMARK_CAPTURE(OptimizePoseOf, soft_se3, PlanarMode::kSoftSe3)->Arg(100)->Arg(400)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(OptimizePoseOf, se2_xyz, PlanarMode::kSe2Xyz)->Arg(100)->Arg(400)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(OptimizePoseOf, hard, PlanarMode::kHard)->Arg(100)->Arg(400)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace planar_vslam
