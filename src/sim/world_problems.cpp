// What makes a world impossible, in the order of the file's sections.
#include <algorithm>
#include <cmath>

#include "planar_vslam/geometry/angles.h"
#include "problems.h"

namespace planar_vslam {
namespace {

using sim::kLargestRoom;
using sim::Problems;

constexpr double kHighestRoom = 20.0;  // m
constexpr double kSmallest = 0.005;    // m, of any solid or poster

void CheckRoom(const World& world, Problems& problems) {
  const RoomSpec& room = world.room;
  problems.Range("room.size", room.size.x(), 1.0, kLargestRoom, "m along x");
  problems.Range("room.size", room.size.y(), 1.0, kLargestRoom, "m along y");
  problems.Range("room.size", room.size.z(), 1.0, kHighestRoom, "m in height");
  problems.Range("room.skirting", room.skirting, 0.0, 0.5, "m");
  problems.Range("room.ambient", room.ambient, 0.0, 1.0);
  problems.Range("room.gloss", room.gloss, 0.0, 1.0);
  problems.Range("room.roughness_deg", RadiansToDegrees(room.roughness), 0.0, 45.0, "deg");
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

void CheckDoorways(const std::string& key, const ObjectSpec& wall, Problems& problems) {
  double done = 0.0;
  for (std::size_t i = 0; i < wall.doorways.size(); ++i) {
    const DoorwaySpec& doorway = wall.doorways[i];
    const std::string own = fmt::format("{}.doorways[{}]", key, i);
    problems.Range(own + ".width", doorway.width, kSmallest, wall.size.x(), "m");
    problems.Range(own + ".height", doorway.height, kSmallest, wall.height, "m");
    const double low = done + 0.5 * doorway.width, high = wall.size.x() - 0.5 * doorway.width;
    if (!(doorway.along >= low && doorway.along <= high)) {
      problems.Add(own + ".along", fmt::format("expected {} to {} m, after the doorway before it and within the wall, "
                                               "got {}",
                                               low, high, doorway.along));
    }
    done = doorway.along + 0.5 * doorway.width;
  }
}

void CheckObjects(const World& world, const char* list, const std::vector<ObjectSpec>& objects, Problems& problems) {
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const ObjectSpec& object = objects[i];
    const std::string key = fmt::format("{}[{}]", list, i);
    problems.Inside(key + ".at", object.at, world.room);
    problems.Range(key + ".size", object.size.minCoeff(), kSmallest, kLargestRoom, "m");
    problems.Range(key + ".size", object.size.maxCoeff(), kSmallest, kLargestRoom, "m");
    problems.Range(key + ".bottom", object.bottom, 0.0, world.room.size.z(), "m");
    problems.Range(key + ".height", object.height, kSmallest, world.room.size.z() - object.bottom, "m");
    problems.Range(key + ".boards", object.boards, 2, 20);
    problems.Texture(key + ".texture", object.texture);
    if (object.kind == ObjectKind::kRamp) {
      problems.Range(key + ".plateau", object.plateau, 0.0, object.size.x() - kSmallest, "m");
      const double run = (object.size.x() - object.plateau) / (object.both_ways ? 2.0 : 1.0);
      // Steeper than a sill's edge, the robot would not climb it.
      if (object.height > run) problems.Add(key + ".height", fmt::format("expected at most {} m, 45 degrees", run));
    }
    CheckDoorways(key, object, problems);
  }
}

// m, length and height of the wall a poster hangs on.
Eigen::Vector2d WallSize(const World& world, const PosterSpec& poster) {
  const bool along_x = poster.wall == Wall::kSouth || poster.wall == Wall::kNorth;
  for (const ObjectSpec& object : world.objects) {
    if (!poster.inner_wall.empty() && object.name == poster.inner_wall) return {object.size.x(), object.height};
  }
  return {along_x ? world.room.size.x() : world.room.size.y(), world.room.size.z()};
}

void CheckPosters(const World& world, Problems& problems) {
  for (std::size_t i = 0; i < world.posters.size(); ++i) {
    const PosterSpec& poster = world.posters[i];
    const std::string key = fmt::format("posters[{}]", i);
    const Eigen::Vector2d wall = WallSize(world, poster);
    const std::string name = poster.inner_wall.empty() ? Name(poster.wall) : poster.inner_wall;
    problems.Range(key + ".size", poster.size.minCoeff(), kSmallest, kLargestRoom, "m");
    if (poster.size.x() > wall.x() || poster.size.y() > wall.y()) {
      problems.Add(key + ".size", fmt::format("expected to fit the {} wall of {} x {} m", name, wall.x(), wall.y()));
      continue;
    }
    problems.Range(key + ".along", poster.along, 0.5 * poster.size.x(), wall.x() - 0.5 * poster.size.x(), "m");
    problems.Range(key + ".height", poster.height, 0.5 * poster.size.y(), wall.y() - 0.5 * poster.size.y(), "m");
    problems.Texture(key + ".texture", poster.texture);
  }
}

void CheckPeople(const World& world, Problems& problems) {
  for (std::size_t i = 0; i < world.people.size(); ++i) {
    const PersonSpec& person = world.people[i];
    const std::string key = fmt::format("people[{}]", i);
    for (std::size_t j = 0; j < person.path.size(); ++j) {
      problems.Inside(fmt::format("{}.path[{}]", key, j), person.path[j], world.room);
      if (j > 0 && (person.path[j] - person.path[j - 1]).norm() < kSmallest) {
        problems.Add(fmt::format("{}.path[{}]", key, j), "expected another place than the point before");
      }
    }
    if (person.path.size() < 2) problems.Add(key + ".path", "expected at least 2 points");
    problems.Range(key + ".speed", person.speed, 0.0, 5.0, "m/s");
    problems.Range(key + ".start", person.start, 0.0, 1000.0, "m");
    problems.Range(key + ".height", person.height, 0.5, std::min(2.3, world.room.size.z()), "m");
  }
}

void CheckLight(const LightSpec& light, Problems& problems) {
  problems.Range("light.level", light.level, 0.0, 100.0);
  problems.Range("light.lamps", light.lamps, 0.0, 100.0);
  problems.Range("light.windows", light.windows, 0.0, 100.0);
  problems.Range("light.sun", light.sun, 0.0, 100.0);
  problems.Range("light.sun_elevation_deg", RadiansToDegrees(light.sun_elevation), 1.0, 90.0, "deg");
}

}  // namespace

std::vector<WorldProblem> FindProblems(const World& world) {
  Problems problems;
  CheckRoom(world, problems);
  CheckObjects(world, "objects", world.objects, problems);
  CheckObjects(world, "ramp_objects", world.ramp_objects, problems);
  CheckPosters(world, problems);
  CheckPeople(world, problems);
  CheckLight(world.light, problems);
  sim::CheckRobot(world, problems);
  sim::CheckEvents(world, problems);
  return problems.Take();
}

}  // namespace planar_vslam
