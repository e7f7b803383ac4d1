// Speed of the simulator's sensors in the shipped worlds, on one thread.
#include <benchmark/benchmark.h>

#include <filesystem>
#include <string>

#include "planar_vslam/sim/drive.h"
#include "planar_vslam/sim/sensors.h"

namespace planar_vslam {
namespace {

World Shipped(const std::string& name) {
  return LoadWorld(std::filesystem::path(PV_SOURCE_DIR) / "config/worlds" / (name + ".yaml")).value();
}

// Images along the world's drive, turning as the robot turns.
void Render(benchmark::State& state, const std::string& name) {
  const World world = Shipped(name);
  const Drive drive = PlanDrive(world).value();
  const Scene scene(world, 1);
  const CameraSensor camera(world.camera);
  double time = 0.0;
  for (auto _ : state) {
    constexpr double kStep = 0.005;  // s
    CameraShot shot;
    const auto camera_at = [&](double t) { return Embed3(drive.At(t)) * world.camera.T_base_camera(); };
    shot.T_world_camera = camera_at(time);
    shot.velocity = LogSe3(camera_at(time).Inverse() * camera_at(time + kStep)) / kStep;
    shot.exposure.time = world.camera.exposure_time;
    benchmark::DoNotOptimize(camera.Render(scene, shot));
    time = time + 1.7 < drive.duration() ? time + 1.7 : 0.0;
  }
}
BENCHMARK_CAPTURE(Render, sample_lab, "sample_lab")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Render, mechatronics_lab, "mechatronics_lab")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Render, south_hall, "south_hall")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Render, chemistry_hall, "chemistry_hall")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Render, corridor_loop, "corridor_loop")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Render, office, "office")->Unit(benchmark::kMillisecond);

void Scan(benchmark::State& state) {
  const World world = Shipped("mechatronics_lab");
  const Scene scene(world, 1);
  LaserSensor laser(world.laser, 1);
  for (auto _ : state) {
    benchmark::DoNotOptimize(laser.Scan(scene, {}, Embed3(world.drive.start) * world.laser.T_base_laser()));
  }
}
BENCHMARK(Scan)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace planar_vslam
