// What makes a world impossible, in the order of the file's sections.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "planar_vslam/sim/solids.h"
#include "planar_vslam/sim/world.h"

namespace planar_vslam {
namespace {

// Bounds against typing errors: a hall no larger than this, a texture memory that still fits.
constexpr double kLargestRoom = 100.0;   // m
constexpr double kHighestRoom = 20.0;    // m
constexpr double kLargestRate = 1000.0;  // Hz
constexpr int kLargestImage = 4096;      // px
constexpr double kSmallest = 0.005;      // m, of any solid or poster

class Problems {
 public:
  void Add(const std::string& key, const std::string& message) { list_.push_back({key, message}); }
  // Also refuses what is not a number.
  void Range(const std::string& key, double value, double low, double high, const char* unit = "") {
    if (value >= low && value <= high) return;
    const std::string space = *unit == '\0' ? "" : " ";
    Add(key, fmt::format("expected {} to {}{}{}, got {}", low, high, space, unit, value));
  }
  void Inside(const std::string& key, const Eigen::Vector2d& point, const RoomSpec& room) {
    const bool inside = point.x() >= 0 && point.y() >= 0 && point.x() <= room.size.x() && point.y() <= room.size.y();
    if (inside) return;
    Add(key, fmt::format("expected a point inside the room of {} x {} m, got [{}, {}]", room.size.x(), room.size.y(),
                         point.x(), point.y()));
  }
  void Texture(const std::string& key, const TextureSpec& texture) {
    const auto contains = [&texture](const std::vector<std::string>& styles) {
      return std::find(styles.begin(), styles.end(), texture.style) != styles.end();
    };
    const bool picture = contains(PictureStyles());
    if (!picture && !contains(SurfaceStyles())) {
      Add(key, fmt::format("expected one of {}, {}, got '{}'", fmt::join(SurfaceStyles(), ", "),
                           fmt::join(PictureStyles(), ", "), texture.style));
    }
    if (texture.shade == TextureSpec::kDefaultShade) return;
    if (picture) Add(key, fmt::format("expected no shade for the picture '{}'", texture.style));
    if (texture.shade < 0 || texture.shade > 255) {
      Add(key, fmt::format("expected a shade of 0 to 255, got {}", texture.shade));
    }
  }
  std::vector<WorldProblem> Take() { return std::move(list_); }

 private:
  std::vector<WorldProblem> list_;
};

void CheckRoom(const World& world, Problems& problems) {
  const RoomSpec& room = world.room;
  problems.Range("room.size", room.size.x(), 1.0, kLargestRoom, "m along x");
  problems.Range("room.size", room.size.y(), 1.0, kLargestRoom, "m along y");
  problems.Range("room.size", room.size.z(), 1.0, kHighestRoom, "m in height");
  problems.Range("room.skirting", room.skirting, 0.0, 0.5, "m");
  problems.Range("room.ambient", room.ambient, 0.0, 1.0);
  problems.Texture("room.floor", room.floor);
  problems.Texture("room.walls", room.walls);
  problems.Texture("room.ceiling", room.ceiling);
  for (std::size_t i = 0; i < world.lamps.size(); ++i) {
    const LampSpec& lamp = world.lamps[i];
    const std::string key = fmt::format("lamps[{}]", i);
    problems.Inside(key + ".at", lamp.at, room);
    problems.Range(key + ".size", lamp.size.minCoeff(), kSmallest, kLargestRoom, "m");
    problems.Range(key + ".power", lamp.power, 0.0, 1000.0);
  }
}

void CheckObjects(const World& world, Problems& problems) {
  for (std::size_t i = 0; i < world.objects.size(); ++i) {
    const ObjectSpec& object = world.objects[i];
    const std::string key = fmt::format("objects[{}]", i);
    problems.Inside(key + ".at", object.at, world.room);
    problems.Range(key + ".size", object.size.minCoeff(), kSmallest, kLargestRoom, "m");
    problems.Range(key + ".size", object.size.maxCoeff(), kSmallest, kLargestRoom, "m");
    problems.Range(key + ".bottom", object.bottom, 0.0, world.room.size.z(), "m");
    problems.Range(key + ".height", object.height, kSmallest, world.room.size.z() - object.bottom, "m");
    problems.Range(key + ".boards", object.boards, 2, 20);
    problems.Texture(key + ".texture", object.texture);
  }
}

void CheckPosters(const World& world, Problems& problems) {
  for (std::size_t i = 0; i < world.posters.size(); ++i) {
    const PosterSpec& poster = world.posters[i];
    const std::string key = fmt::format("posters[{}]", i);
    const bool along_x = poster.wall == Wall::kSouth || poster.wall == Wall::kNorth;
    const Eigen::Vector2d wall(along_x ? world.room.size.x() : world.room.size.y(), world.room.size.z());
    problems.Range(key + ".size", poster.size.minCoeff(), kSmallest, kLargestRoom, "m");
    if (poster.size.x() > wall.x() || poster.size.y() > wall.y()) {
      problems.Add(key + ".size",
                   fmt::format("expected to fit the {} wall of {} x {} m", Name(poster.wall), wall.x(), wall.y()));
      continue;
    }
    problems.Range(key + ".along", poster.along, 0.5 * poster.size.x(), wall.x() - 0.5 * poster.size.x(), "m");
    problems.Range(key + ".height", poster.height, 0.5 * poster.size.y(), wall.y() - 0.5 * poster.size.y(), "m");
    problems.Texture(key + ".texture", poster.texture);
  }
}

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

void CheckDrive(const World& world, const std::vector<Prism>& solids, Problems& problems) {
  const DriveSpec& drive = world.drive;
  CheckPlace(world, solids, "drive.start", drive.start.translation, problems);
  for (std::size_t i = 0; i < drive.waypoints.size(); ++i) {
    CheckPlace(world, solids, fmt::format("drive.waypoints[{}]", i), drive.waypoints[i], problems);
  }
  problems.Range("drive.shuffle", drive.shuffle, -10.0, 10.0, "m");
  problems.Range("drive.laps", drive.laps, 0.0, 100.0);
  if (drive.laps > 0.0 && drive.waypoints.size() < 3)
    problems.Add("drive.waypoints", "expected at least 3 to drive laps");
  if (drive.waypoints.empty() && drive.shuffle == 0.0) problems.Add("drive", "expected waypoints or a shuffle");
  problems.Range("drive.speed", drive.speed, 0.01, 5.0, "m/s");
  problems.Range("drive.sideways_speed", drive.sideways_speed, 0.01, 5.0, "m/s");
  problems.Range("drive.acceleration", drive.acceleration, 0.01, 20.0, "m/s^2");
  problems.Range("drive.turn_rate_deg", RadiansToDegrees(drive.turn_rate), 1.0, 720.0, "deg/s");
  problems.Range("drive.turn_acceleration_deg", RadiansToDegrees(drive.turn_acceleration), 1.0, 7200.0, "deg/s^2");
  problems.Range("drive.robot_radius", drive.robot_radius, 0.0, 2.0, "m");
}

void CheckSensors(const World& world, Problems& problems) {
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

std::vector<WorldProblem> FindProblems(const World& world) {
  Problems problems;
  CheckRoom(world, problems);
  CheckObjects(world, problems);
  CheckPosters(world, problems);
  CheckDrive(world, MakeSolids(world.objects), problems);
  CheckSensors(world, problems);
  return problems.Take();
}

}  // namespace planar_vslam
