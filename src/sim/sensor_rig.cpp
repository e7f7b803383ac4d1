#include "planar_vslam/sim/sensor_rig.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "planar_vslam/sim/random.h"

namespace planar_vslam {
namespace {

constexpr Timestamp kNever{std::numeric_limits<std::int64_t>::max()};
constexpr double kVelocityStep = 0.005;  // s to both sides, for the camera's velocity

// Of the count-th measurement of a sensor.
Timestamp StampAt(std::int64_t count, double rate) { return Timestamp::FromSeconds(static_cast<double>(count) / rate); }

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

SensorRig::SensorRig(const World& world, const SensorOptions& options)
    : world_(world),
      options_(options),
      head_(world.head, world.camera),
      slips_(world.events, options.seed),
      scene_(std::make_unique<Scene>(world, options.seed)),
      camera_(world.camera, options.threads),
      exposure_(world.camera),
      shake_(world.camera.shake, 1.0 / world.camera.rate, options.seed),
      laser_(world.laser, options.seed),
      odometer_(world.odometry, world.drive.base, options.seed) {}

double SensorRig::lead() const { return kVelocityStep + std::max(0.0, -world_.camera.time_offset); }

std::optional<SimulatedEvent> SensorRig::Next(const TrueMotion& motion, double until) {
  const Timestamp odometry = StampAt(odometry_count_, world_.odometry.rate);
  const Timestamp image = StampAt(image_count_, world_.camera.rate);
  const Timestamp scan = world_.laser.present() ? StampAt(scan_count_, world_.laser.rate) : kNever;
  const Timestamp next = std::min({odometry, scan, image});
  if (next > Timestamp::FromSeconds(until)) return std::nullopt;
  if (odometry == next) return NextOdometry(motion);
  if (scan == next) return NextScan(motion);
  return NextImage(motion);
}

SimulatedEvent SensorRig::NextOdometry(const TrueMotion& motion) {
  const double last = StampAt(std::max<std::int64_t>(odometry_count_ - 1, 0), world_.odometry.rate).Seconds();
  const Timestamp stamp = StampAt(odometry_count_++, world_.odometry.rate);
  const double now = stamp.Seconds();
  // Whoever carries the robot does not turn its wheels.
  const OdometryReading reading = odometer_.Update(stamp, motion.At(now, last), slips_.Factor(last, now));
  if (motion.Carried(last, now)) odometer_.Carry(motion.At(now));
  return {reading, motion.At(now), {}};
}

SimulatedEvent SensorRig::NextScan(const TrueMotion& motion) {
  const Timestamp stamp = StampAt(scan_count_++, world_.laser.rate);
  const Rigid3 T_world_base = motion.At(stamp.Seconds());
  const Rigid3 T_base_laser = world_.laser.T_base_laser();
  MovePeople(motion, stamp.Seconds());
  return {LaserFrame{laser_.Scan(*scene_, stamp, T_world_base * T_base_laser), T_base_laser}, T_world_base, {}};
}

SimulatedEvent SensorRig::NextImage(const TrueMotion& motion) {
  const auto number = static_cast<std::uint64_t>(image_count_);
  const Timestamp stamp = StampAt(image_count_++, world_.camera.rate);
  const double seen = stamp.Seconds() - world_.camera.time_offset;
  const Rigid3 T_camera_shaken(shake_.Next(), Eigen::Vector3d::Zero());
  const Rigid3 T_world_camera = CameraAt(motion, seen, seen) * T_camera_shaken;
  // The robot's transforms are as late as its pictures' stamps say.
  CameraFrame frame{{stamp, {}}, head_.ReportedCamera(stamp.Seconds())};
  if (options_.render) frame.image.image = Photograph(motion, seen, T_world_camera, number);
  return {frame, motion.At(stamp.Seconds()), T_world_camera};
}

GrayImage SensorRig::Photograph(const TrueMotion& motion, double time, const Rigid3& T_world_camera,
                                std::uint64_t number) {
  CameraShot shot;
  shot.T_world_camera = T_world_camera;
  shot.velocity =
      LogSe3(CameraAt(motion, time - kVelocityStep, time).Inverse() * CameraAt(motion, time + kVelocityStep, time)) /
      (2.0 * kVelocityStep);
  shot.noise_seed = MixSeed(MixSeed(options_.seed, RandomStream::kImageNoise), number);
  shot.exposure = exposure_.Next();
  if (AnyContains(world_.events.blackouts, time)) shot.exposure.factor = 0.0;
  MovePeople(motion, time);
  GrayImage image = camera_.Render(*scene_, shot);
  exposure_.Observe(image);
  return image;
}

void SensorRig::MovePeople(const TrueMotion& motion, double time) {
  std::vector<Walker> walkers;
  for (std::size_t i = 0; i < world_.people.size(); ++i)
    walkers.push_back(WalkerAt(world_.people[i], motion.PersonTime(i, time)));
  Walker occluder;
  occluder.present = false;
  for (const SpanSpec& span : world_.events.occlusions) {
    if (!span.Contains(time)) continue;
    // Across the view, a little faster than the robot turns away.
    constexpr double kAhead = 0.75, kReach = 0.35;  // m
    const double share = 2.0 * (time - span.at) / span.duration - 1.0;
    const Rigid3 T_world_base = motion.At(time);
    occluder.T_world_walker = ProjectToPlane(T_world_base) * Rigid2(kAhead, -kReach * share, -M_PI_2);
    occluder.floor = T_world_base.translation.z();
    occluder.present = true;
  }
  walkers.push_back(occluder);
  scene_->Place(walkers);
}

Rigid3 SensorRig::CameraAt(const TrueMotion& motion, double time, double carried_until) const {
  return motion.At(time, carried_until) * head_.TrueCamera(time);
}

}  // namespace planar_vslam
