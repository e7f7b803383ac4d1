#include "planar_vslam/sim/simulation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "planar_vslam/sim/random.h"

namespace planar_vslam {
namespace {

// Of the count-th measurement of a sensor.
Timestamp StampAt(std::int64_t count, double rate) { return Timestamp::FromSeconds(static_cast<double>(count) / rate); }

}  // namespace

Timestamp StampOf(const SimulatedEvent& event) {
  struct Visitor {
    Timestamp operator()(const CameraFrame& frame) const { return frame.image.stamp; }
    Timestamp operator()(const OdometryReading& reading) const { return reading.stamp; }
    Timestamp operator()(const LaserFrame& frame) const { return frame.scan.stamp; }
  };
  return std::visit(Visitor(), event.measurement);
}

Expected<Simulation> Simulation::Create(const World& world, const SimulationOptions& options) {
  const std::vector<WorldProblem> problems = FindProblems(world);
  if (!problems.empty()) return Error{fmt::format("{}: {}: {}", world.source, problems[0].key, problems[0].message)};
  if (!(options.until > 0.0)) return Error{fmt::format("until: expected more than 0 s, got {}", options.until)};
  Expected<Drive> drive = PlanDrive(world);
  if (!drive) return drive.error();
  return Simulation(world, options, std::move(drive).value());
}

Simulation::Simulation(const World& world, const SimulationOptions& options, Drive drive)
    : world_(world),
      options_(options),
      drive_(std::move(drive)),
      end_(std::min(options.until, drive_.duration())),
      scene_(std::make_unique<Scene>(world, options.seed)),
      camera_(world.camera, options.threads),
      shake_(world.camera.shake, 1.0 / world.camera.rate, options.seed),
      laser_(world.laser, options.seed),
      odometer_(world.odometry, options.seed) {}

std::optional<SimulatedEvent> Simulation::Next() {
  const Timestamp odometry = StampAt(odometry_count_, world_.odometry.rate);
  const Timestamp scan = StampAt(scan_count_, world_.laser.rate);
  const Timestamp image = StampAt(image_count_, world_.camera.rate);
  const Timestamp next = std::min({odometry, scan, image});
  if (next > Timestamp::FromSeconds(end_)) return std::nullopt;
  if (odometry == next) return NextOdometry();
  if (scan == next) return NextScan();
  return NextImage();
}

SimulatedEvent Simulation::NextOdometry() {
  const Timestamp stamp = StampAt(odometry_count_++, world_.odometry.rate);
  const Rigid2 T_world_base = drive_.At(stamp.Seconds());
  return {odometer_.Update(stamp, T_world_base), T_world_base, {}};
}

SimulatedEvent Simulation::NextScan() {
  const Timestamp stamp = StampAt(scan_count_++, world_.laser.rate);
  const Rigid2 T_world_base = drive_.At(stamp.Seconds());
  const Rigid3 T_base_laser = world_.laser.T_base_laser();
  return {LaserFrame{laser_.Scan(*scene_, stamp, Embed3(T_world_base) * T_base_laser), T_base_laser}, T_world_base, {}};
}

SimulatedEvent Simulation::NextImage() {
  const auto number = static_cast<std::uint64_t>(image_count_);
  const Timestamp stamp = StampAt(image_count_++, world_.camera.rate);
  const Rigid2 T_world_base = drive_.At(stamp.Seconds());
  const Rigid3 T_base_camera = world_.camera.T_base_camera();
  const Rigid3 T_camera_shaken(shake_.Next(), Eigen::Vector3d::Zero());
  const Rigid3 T_world_camera = Embed3(T_world_base) * T_base_camera * T_camera_shaken;
  CameraFrame frame{{stamp, {}}, T_base_camera};
  if (options_.render) {
    CameraShot shot;
    shot.T_world_camera = T_world_camera;
    shot.noise_seed = MixSeed(MixSeed(options_.seed, RandomStream::kImageNoise), number);
    frame.image.image = camera_.Render(*scene_, shot);
  }
  return {frame, T_world_base, T_world_camera};
}

}  // namespace planar_vslam
