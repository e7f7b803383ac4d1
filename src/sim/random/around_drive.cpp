// What comes into the building once the drive is known.
#include <limits>

#include "free_space.h"
#include "planar_vslam/sim/floor.h"
#include "planar_vslam/sim/scene.h"
#include "planar_vslam/sim/solids.h"
#include "robot_draw.h"

namespace planar_vslam::sim {
namespace {

constexpr double kClear = 0.08;         // m, between the driving robot and what stands about
constexpr double kPersonRadius = 0.25;  // m, as Obstacles has it

// Places of the robot's middle, a few centimetres apart.
std::vector<Vector2d> PlacesOf(const Drive& drive) {
  constexpr double kApart = 0.05;  // m
  std::vector<Vector2d> places = {drive.At(0.0).translation};
  for (double t = 0.0; t <= drive.duration(); t += 10.0 * Drive::kStep) {
    const Vector2d at = drive.At(t).translation;
    if ((at - places.back()).norm() > kApart) places.push_back(at);
  }
  return places;
}

double DistanceTo(const std::vector<Vector2d>& places, const Vector2d& at) {
  double least = std::numeric_limits<double>::infinity();
  for (const Vector2d& place : places) least = std::min(least, (place - at).squaredNorm());
  return std::sqrt(least);
}

bool OnRamp(const World& world, const Vector2d& at, double reach) {
  for (const ObjectSpec& object : world.objects) {
    if (object.kind != ObjectKind::kRamp) continue;
    for (const Prism& part : MakeSolids({object})) {
      if (Distance(at, part.footprint) < reach) return true;
    }
  }
  return false;
}

// A straight piece of the way, long enough for a ramp.
struct Stretch {
  Vector2d from, to;
};
std::optional<Stretch> DrawStretch(const DriveSpec& drive, Draws& draws) {
  constexpr double kShortest = 3.5;  // m
  std::vector<Stretch> stretches;
  Vector2d from = drive.start.translation;
  for (const Vector2d& to : drive.waypoints) {
    if ((to - from).norm() > kShortest) stretches.push_back({from, to});
    from = to;
  }
  if (stretches.empty()) return std::nullopt;
  return draws.Pick(stretches);
}

// Whether the robot goes up and down its slopes, and never over its edges.
bool DrivesWell(const World& world, const Drive& drive, double slope) {
  const Floor floor(world);
  constexpr double kRounding = 0.005;  // rad
  for (double t = 0.0; t <= drive.duration(); t += 10.0 * Drive::kStep) {
    const double upright = floor.Stand(drive.At(t)).R()(2, 2);
    if (upright < std::cos(slope + kRounding)) return false;
  }
  return true;
}

ObjectSpec DrawThing(Draws& draws) {
  ObjectSpec thing;
  thing.kind =
      draws.Weighted<ObjectKind>({{2.0, ObjectKind::kBox}, {1.0, ObjectKind::kChair}, {1.5, ObjectKind::kSwivelChair}});
  thing.yaw = draws.Uniform(-M_PI, M_PI);
  const int shade = 50 + 35 * draws.Whole(0, 3);
  if (thing.kind == ObjectKind::kBox) {
    thing.size = {draws.Uniform(0.25, 0.7), draws.Uniform(0.25, 0.7)};
    thing.height = draws.Uniform(0.2, 1.4);
    thing.texture = {
        draws.Weighted<const char*>({{3.0, "wood"}, {2.0, "shapes"}, {1.0, "photo"}, {1.0, "board"}, {1.0, "text"}})};
    return thing;
  }
  thing.size = thing.kind == ObjectKind::kChair ? Vector2d(0.44, 0.44) : Vector2d(0.48, 0.48);
  thing.height = thing.kind == ObjectKind::kChair ? 0.9 : 0.95;
  thing.texture = {"fabric", shade};
  return thing;
}

Vector2d DrawPlace(const Area& area, Draws& draws) {
  const double x = draws.Uniform(area.min().x(), area.max().x()), y = draws.Uniform(area.min().y(), area.max().y());
  return {x, y};
}

// Whether person and robot, both on their ways, never meet.
bool KeepsAway(const PersonSpec& person, const World& world, const Drive& drive) {
  const double least = world.drive.robot_radius + kPersonRadius + kClear;
  for (double t = 0.0; t <= drive.duration(); t += 10.0 * Drive::kStep) {
    if ((WalkerAt(person, t).T_world_walker.translation - drive.At(t).translation).norm() < least) return false;
  }
  return true;
}

bool WalksFreely(const PersonSpec& person, const World& world, const FreeSpace& space) {
  const Vector2d step = person.path[1] - person.path[0];
  if (space.Clearance(person.path[0], person.path[1]) < kPersonRadius + 0.1) return false;
  for (double share = 0.0; share <= 1.0; share += 0.02) {
    if (OnRamp(world, person.path[0] + share * step, kPersonRadius)) return false;
  }
  return true;
}

}  // namespace

void AddSills(Building* building, Draws& draws) {
  if (!draws.Chance(0.4)) return;
  const double height = draws.Uniform(0.005, 0.015);  // m
  for (const Opening& opening : building->openings) {
    if (!draws.Chance(0.5)) continue;
    ObjectSpec sill;
    sill.kind = ObjectKind::kRamp;
    sill.at = opening.at, sill.yaw = std::atan2(opening.across.y(), opening.across.x());
    sill.size = {0.12, opening.width}, sill.height = height, sill.plateau = 0.06;
    building->world.objects.push_back(sill);
  }
}

void AddRamp(World* world, const Drive& drive, Draws& draws) {
  const double slope = draws.Uniform(2.0, 5.0) * M_PI / 180.0;
  const std::optional<Stretch> stretch = DrawStretch(world->drive, draws);
  if (!stretch.has_value()) return;
  const Vector2d way = stretch->to - stretch->from;
  ObjectSpec ramp;
  ramp.kind = ObjectKind::kRamp;
  const double length = std::min(way.norm() - 0.8, draws.Uniform(2.5, 7.0));
  ramp.at = 0.5 * (stretch->from + stretch->to);
  ramp.yaw = std::atan2(way.y(), way.x());
  ramp.size = {length, draws.Uniform(1.2, 2.4)};
  ramp.plateau = draws.Uniform(0.1, 0.3) * length;
  ramp.height = 0.5 * (length - ramp.plateau) * std::tan(slope);
  ramp.texture = {"planks"};
  World with = *world;
  with.objects.push_back(ramp);
  if (DrivesWell(with, drive, slope)) *world = with;
}

void AddClutter(Building* building, const Drive& drive, Draws& draws) {
  World& world = building->world;
  const FreeSpace space(world);
  std::vector<Vector2d> places = PlacesOf(drive);
  std::vector<std::pair<Vector2d, double>> standing;  // middle and radius
  for (const Zone& zone : building->zones) {
    constexpr double kMost = 0.12;  // things a square metre
    const int tries = static_cast<int>(kMost * zone.area.volume() * building->style.clutter);
    for (int i = 0; i < tries; ++i) {
      ObjectSpec thing = DrawThing(draws);
      thing.at = DrawPlace(zone.area, draws);
      const double radius = 0.5 * thing.size.norm();
      const auto meets = [&](const auto& other) { return (other.first - thing.at).norm() < other.second + radius; };
      if (space.Clearance(thing.at) < radius + FreeSpace::kCell || OnRamp(world, thing.at, radius)) continue;
      if (DistanceTo(places, thing.at) < world.drive.robot_radius + radius + kClear) continue;
      if (std::any_of(standing.begin(), standing.end(), meets)) continue;
      standing.emplace_back(thing.at, radius);
      world.objects.push_back(thing);
    }
  }
}

void AddPeople(Building* building, const Drive& drive, Draws& draws) {
  World& world = building->world;
  const int wanted = draws.Weighted<int>({{0.6, 0}, {0.2, 1}, {0.1, 2}, {0.1, 3}});
  const FreeSpace space(world);
  constexpr int kTries = 30;
  for (int i = 0; i < kTries && static_cast<int>(world.people.size()) < wanted; ++i) {
    const Area& area = draws.Pick(building->zones).area;
    PersonSpec person;
    const Vector2d from = DrawPlace(area, draws);
    const double heading = draws.Uniform(-M_PI, M_PI), length = draws.Uniform(1.5, 8.0);
    person.path = {from, from + length * Vector2d(std::cos(heading), std::sin(heading))};
    person.speed = draws.Uniform(0.3, 1.3);
    person.start = draws.Uniform(0.0, length);
    person.height = draws.Uniform(1.55, 1.95);
    if (WalksFreely(person, world, space) && KeepsAway(person, world, drive)) world.people.push_back(person);
  }
}

}  // namespace planar_vslam::sim
