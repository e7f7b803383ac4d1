// What makes the robot's part of a world impossible.
#include <algorithm>
#include <cmath>
#include <tuple>

#include "planar_vslam/geometry/angles.h"
#include "problems.h"

namespace planar_vslam::sim {
namespace {

constexpr int kLargestImage = 4096;  // px

// The robot's centre must be in the room and in no object its body would meet.
void CheckPlace(const World& world, const std::vector<Prism>& solids, const std::string& key,
                const Eigen::Vector2d& place, Problems& problems) {
  problems.Inside(key, place, world.room);
  for (const Prism& solid : solids) {
    if (!solid.MeetsBand(kBodyLow, kBodyHigh) || Distance(place, solid.footprint) > 0.0) continue;
    const ObjectKind kind = world.objects[static_cast<std::size_t>(solid.object)].kind;
    problems.Add(key, fmt::format("expected free floor, but [{}, {}] lies inside objects[{}], a {}", place.x(),
                                  place.y(), solid.object, Name(kind)));
    return;
  }
}

void CheckDrive(const World& world, const std::string& key, const DriveSpec& drive, Problems& problems) {
  const std::vector<Prism> solids = MakeSolids(world.objects);
  CheckPlace(world, solids, key + ".start", drive.start.translation, problems);
  for (std::size_t i = 0; i < drive.waypoints.size(); ++i) {
    CheckPlace(world, solids, fmt::format("{}.waypoints[{}]", key, i), drive.waypoints[i], problems);
  }
  problems.Range(key + ".shuffle", drive.shuffle, -10.0, 10.0, "m");
  if (drive.base == BaseKind::kDifferential && drive.shuffle != 0.0)
    problems.Add(key + ".shuffle", "expected 0: a differential base cannot move sideways");
  problems.Range(key + ".laps", drive.laps, 0.0, 100.0);
  if (drive.laps > 0.0 && drive.waypoints.size() < 3)
    problems.Add(key + ".waypoints", "expected at least 3 to drive laps");
  if (drive.waypoints.empty() && drive.shuffle == 0.0) problems.Add(key, "expected waypoints or a shuffle");
  problems.Range(key + ".speed", drive.speed, 0.01, 5.0, "m/s");
  problems.Range(key + ".sideways_speed", drive.sideways_speed, 0.01, 5.0, "m/s");
  problems.Range(key + ".acceleration", drive.acceleration, 0.01, 20.0, "m/s^2");
  problems.Range(key + ".turn_rate_deg", RadiansToDegrees(drive.turn_rate), 1.0, 720.0, "deg/s");
  problems.Range(key + ".turn_acceleration_deg", RadiansToDegrees(drive.turn_acceleration), 1.0, 7200.0, "deg/s^2");
  problems.Range(key + ".robot_radius", drive.robot_radius, 0.0, 2.0, "m");
}

void CheckLimits(const LimitsSpec& limits, Problems& problems) {
  problems.Range("limits.speed", limits.speed, 0.01, 5.0, "m/s");
  problems.Range("limits.sideways_speed", limits.sideways_speed, 0.01, 5.0, "m/s");
  problems.Range("limits.acceleration", limits.acceleration, 0.01, 20.0, "m/s^2");
  problems.Range("limits.turn_rate_deg", RadiansToDegrees(limits.turn_rate), 1.0, 720.0, "deg/s");
  problems.Range("limits.turn_acceleration_deg", RadiansToDegrees(limits.turn_acceleration), 1.0, 7200.0, "deg/s^2");
  problems.Range("limits.command_timeout", limits.command_timeout, 0.01, 60.0, "s");
}

void CheckCamera(const World& world, Problems& problems) {
  const CameraSpec& camera = world.camera;
  problems.Range("camera.size", camera.model.width, 8, kLargestImage, "px");
  problems.Range("camera.size", camera.model.height, 8, kLargestImage, "px");
  for (const std::string& problem : camera.model.Problems()) problems.Add("camera", problem);
  problems.Range("camera.rate", camera.rate, 0.01, kLargestRate, "Hz");
  problems.Range("camera.position", camera.position.z(), 0.01, world.room.size.z() - 0.01, "m in height");
  problems.Range("camera.position", camera.position.head<2>().norm(), 0.0, 2.0, "m from the base's axis");
  problems.Range("camera.tilt_down_deg", RadiansToDegrees(camera.tilt_down), -89.0, 89.0, "deg");
  problems.Range("camera.shake_deg", RadiansToDegrees(camera.shake), 0.0, 10.0, "deg");
  problems.Range("camera.noise", camera.noise, 0.0, 100.0, "grey levels");
  problems.Range("camera.exposure", camera.exposure, 0.01, 100.0);
  problems.Range("camera.exposure_target", camera.exposure_target, 1.0, 254.0, "grey levels");
  problems.Range("camera.exposure_response", camera.exposure_response, 0.001, 60.0, "s");
  problems.Range("camera.exposure_ms", 1e3 * camera.exposure_time, 0.0, 1e3, "ms");
  problems.Range("camera.longest_exposure_ms", 1e3 * camera.longest_exposure, 1e-3, 1e3, "ms");
  problems.Range("camera.rolling_shutter_ms", 1e3 * camera.rolling_shutter, 0.0, 1e3, "ms");
  problems.Range("camera.time_offset_ms", 1e3 * camera.time_offset, -1e3, 1e3, "ms");
}

void CheckHead(const HeadSpec& head, Problems& problems) {
  problems.Range("head.neck", head.neck.z(), 0.0, 3.0, "m in height");
  problems.Range("head.neck", head.neck.head<2>().norm(), 0.0, 2.0, "m from the base's axis");
  problems.Range("head.period", head.period, 0.0, kLongest, "s");
  problems.Range("head.backlash_deg", RadiansToDegrees(head.backlash), 0.0, 20.0, "deg");
  for (std::size_t i = 0; i < head.motion.size(); ++i) {
    const std::string key = fmt::format("head.motion[{}]", i);
    problems.Range(key, RadiansToDegrees(head.motion[i].pan), -180.0, 180.0, "deg of pan");
    problems.Range(key, RadiansToDegrees(head.motion[i].tilt), -80.0, 80.0, "deg of tilt");
    const bool later = i == 0 ? head.motion[i].time >= 0.0 : head.motion[i].time > head.motion[i - 1].time;
    if (!later) problems.Add(key, "expected a time after the one before it");
  }
}

void CheckLaserAndOdometry(const World& world, Problems& problems) {
  const LaserSpec& laser = world.laser;
  problems.Range("laser.rate", laser.rate, 0.01, kLargestRate, "Hz");
  problems.Range("laser.height", laser.height, 0.01, world.room.size.z() - 0.01, "m");
  problems.Range("laser.field_of_view_deg", RadiansToDegrees(laser.field_of_view), 1.0, 360.0, "deg");
  problems.Range("laser.beams", laser.beams, 2, 100000);
  problems.Range("laser.range_max", laser.range_max, 0.1, 1000.0, "m");
  problems.Range("laser.noise", laser.noise, 0.0, 10.0, "m");
  const OdometrySpec& odometry = world.odometry;
  problems.Range("odometry.rate", odometry.rate, 0.01, kLargestRate, "Hz");
  problems.Range("odometry.scale", odometry.scale, 0.1, 10.0);
  problems.Range("odometry.yaw_scale", odometry.yaw_scale, 0.1, 10.0);
  problems.Range("odometry.translation_noise", odometry.translation_noise, 0.0, 1.0, "m");
  problems.Range("odometry.rotation_noise_deg", RadiansToDegrees(odometry.rotation_noise), 0.0, 90.0, "deg");
}

}  // namespace

void CheckRobot(const World& world, Problems& problems) {
  CheckDrive(world, "drive", world.drive, problems);
  if (world.repeat_drive.has_value()) CheckDrive(world, "repeat_drive", *world.repeat_drive, problems);
  CheckLimits(world.limits, problems);
  CheckCamera(world, problems);
  CheckHead(world.head, problems);
  CheckLaserAndOdometry(world, problems);
}

void CheckEvents(const World& world, Problems& problems) {
  const EventsSpec& events = world.events;
  const auto span = [&problems](const std::string& key, double at, double duration) {
    problems.Range(key + ".at", at, 0.0, kLongest, "s");
    problems.Range(key + ".duration", duration, 0.001, kLongest, "s");
  };
  for (std::size_t i = 0; i < events.slips.size(); ++i) {
    const std::string key = fmt::format("events.slips[{}]", i);
    span(key, events.slips[i].at, events.slips[i].duration);
    problems.Range(key + ".factor", events.slips[i].factor, 0.0, 100.0);
  }
  for (std::size_t i = 0; i < events.blackouts.size(); ++i)
    span(fmt::format("events.blackouts[{}]", i), events.blackouts[i].at, events.blackouts[i].duration);
  for (std::size_t i = 0; i < events.occlusions.size(); ++i)
    span(fmt::format("events.occlusions[{}]", i), events.occlusions[i].at, events.occlusions[i].duration);
  for (std::size_t i = 0; i < events.kidnaps.size(); ++i) {
    const std::string key = fmt::format("events.kidnaps[{}]", i);
    problems.Range(key + ".at", events.kidnaps[i].at, i == 0 ? 0.0 : events.kidnaps[i - 1].at, kLongest, "s");
    problems.Range(key + ".skip", events.kidnaps[i].skip, 0.0, kLongest, "s");
  }
  const RandomSlipSpec& random = events.random_slips;
  problems.Range("events.random_slips.rate", random.rate, 0.0, 600.0, "per minute");
  for (const auto& [name, range, least] :
       {std::tuple("duration", random.duration, 0.001), std::tuple("spinning", random.spinning, 0.0),
        std::tuple("skidding", random.skidding, 0.0)}) {
    if (range[0] >= least && range[1] >= range[0] && range[1] <= 100.0) continue;
    problems.Add(fmt::format("events.random_slips.{}", name),
                 fmt::format("expected a range within {} to 100, got [{}, {}]", least, range[0], range[1]));
  }
}

}  // namespace planar_vslam::sim
