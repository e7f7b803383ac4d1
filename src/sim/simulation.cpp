#include "planar_vslam/sim/simulation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "planar_vslam/sim/random.h"

namespace planar_vslam {
namespace {

// Of the count-th measurement of a sensor.
Timestamp StampAt(std::int64_t count, double rate) { return Timestamp::FromSeconds(static_cast<double>(count) / rate); }

// Given ones and random ones, in the order of time.
std::vector<SlipSpec> AllSlips(const EventsSpec& events, double duration, std::uint64_t seed) {
  std::vector<SlipSpec> slips = events.slips;
  const std::vector<SlipSpec> random = DrawSlips(events.random_slips, duration, seed);
  slips.insert(slips.end(), random.begin(), random.end());
  std::stable_sort(slips.begin(), slips.end(), [](const SlipSpec& a, const SlipSpec& b) { return a.at < b.at; });
  return slips;
}

// The factor between wheels and robot, averaged over the time.
double SlipBetween(const std::vector<SlipSpec>& slips, double from, double to) {
  double factor = 1.0;
  for (const SlipSpec& slip : slips) {
    const double during = std::min(to, slip.at + slip.duration) - std::max(from, slip.at);
    if (during > 0.0) factor += (slip.factor - 1.0) * during / (to - from);
  }
  return std::max(factor, 0.0);
}

bool AnyContains(const std::vector<SpanSpec>& spans, double time) {
  return std::any_of(spans.begin(), spans.end(), [time](const SpanSpec& span) { return span.Contains(time); });
}

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
      motion_(std::move(drive), Floor(world), world.events.kidnaps),
      head_(world.head, world.camera, motion_.duration()),
      slips_(AllSlips(world.events, motion_.duration(), options.seed)),
      end_(std::min(options.until, motion_.duration())),
      scene_(std::make_unique<Scene>(world, options.seed)),
      camera_(world.camera, options.threads),
      exposure_(world.camera),
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
  const double last = StampAt(std::max<std::int64_t>(odometry_count_ - 1, 0), world_.odometry.rate).Seconds();
  const Timestamp stamp = StampAt(odometry_count_++, world_.odometry.rate);
  const double now = stamp.Seconds();
  // Whoever carries the robot does not turn its wheels.
  const OdometryReading reading = odometer_.Update(stamp, motion_.At(now, last), SlipBetween(slips_, last, now));
  if (motion_.Carried(last, now)) odometer_.Carry(motion_.At(now));
  return {reading, motion_.At(now), {}};
}

SimulatedEvent Simulation::NextScan() {
  const Timestamp stamp = StampAt(scan_count_++, world_.laser.rate);
  const Rigid3 T_world_base = motion_.At(stamp.Seconds());
  const Rigid3 T_base_laser = world_.laser.T_base_laser();
  MovePeople(stamp.Seconds());
  return {LaserFrame{laser_.Scan(*scene_, stamp, T_world_base * T_base_laser), T_base_laser}, T_world_base, {}};
}

SimulatedEvent Simulation::NextImage() {
  const auto number = static_cast<std::uint64_t>(image_count_);
  const Timestamp stamp = StampAt(image_count_++, world_.camera.rate);
  const double seen = stamp.Seconds() - world_.camera.time_offset;
  const Rigid3 T_camera_shaken(shake_.Next(), Eigen::Vector3d::Zero());
  const Rigid3 T_world_camera = CameraAt(seen, seen) * T_camera_shaken;
  // The robot's transforms are as late as its pictures' stamps say.
  CameraFrame frame{{stamp, {}}, head_.ReportedCamera(stamp.Seconds())};
  if (options_.render) frame.image.image = Photograph(seen, T_world_camera, number);
  return {frame, motion_.At(stamp.Seconds()), T_world_camera};
}

GrayImage Simulation::Photograph(double time, const Rigid3& T_world_camera, std::uint64_t number) {
  constexpr double kStep = 0.005;  // s, for the velocity
  CameraShot shot;
  shot.T_world_camera = T_world_camera;
  shot.velocity = LogSe3(CameraAt(time - kStep, time).Inverse() * CameraAt(time + kStep, time)) / (2.0 * kStep);
  shot.noise_seed = MixSeed(MixSeed(options_.seed, RandomStream::kImageNoise), number);
  shot.exposure = exposure_.Next();
  if (AnyContains(world_.events.blackouts, time)) shot.exposure.factor = 0.0;
  MovePeople(time);
  GrayImage image = camera_.Render(*scene_, shot);
  exposure_.Observe(image);
  return image;
}

void Simulation::MovePeople(double time) {
  std::vector<Walker> walkers;
  for (const PersonSpec& person : world_.people) walkers.push_back(WalkerAt(person, time));
  Walker occluder;
  occluder.present = false;
  for (const SpanSpec& span : world_.events.occlusions) {
    if (!span.Contains(time)) continue;
    // Across the view, a little faster than the robot turns away.
    constexpr double kAhead = 0.75, kReach = 0.35;  // m
    const double share = 2.0 * (time - span.at) / span.duration - 1.0;
    const Rigid3 T_world_base = motion_.At(time);
    occluder.T_world_walker = ProjectToPlane(T_world_base) * Rigid2(kAhead, -kReach * share, -M_PI_2);
    occluder.floor = T_world_base.translation.z();
    occluder.present = true;
  }
  walkers.push_back(occluder);
  scene_->Place(walkers);
}

Rigid3 Simulation::CameraAt(double time, double carried_until) const {
  return motion_.At(time, carried_until) * head_.TrueCamera(time);
}

}  // namespace planar_vslam
