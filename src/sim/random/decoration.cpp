// What hangs on the walls, and the light.
#include <algorithm>

#include "building.h"
#include "planar_vslam/geometry/angles.h"

namespace planar_vslam::sim {
namespace {

// One side of a wall, to hang things on from its first end to its last.
struct WallSide {
  PosterSpec blank;  // says which wall
  double length = 0.0, height = 0.0;
  std::vector<DoorwaySpec> doorways;
  bool outer = false;
};

std::vector<WallSide> SidesOf(const World& world) {
  std::vector<WallSide> sides;
  for (const Wall wall : {Wall::kSouth, Wall::kEast, Wall::kNorth, Wall::kWest}) {
    WallSide side;
    side.blank.wall = wall;
    side.length = wall == Wall::kSouth || wall == Wall::kNorth ? world.room.size.x() : world.room.size.y();
    side.height = world.room.size.z();
    side.outer = true;
    sides.push_back(side);
  }
  for (const ObjectSpec& object : world.objects) {
    if (object.kind != ObjectKind::kWall) continue;
    for (const bool left : {true, false}) {
      WallSide side;
      side.blank.inner_wall = object.name, side.blank.left = left;
      side.length = object.size.x(), side.height = object.height, side.doorways = object.doorways;
      sides.push_back(side);
    }
  }
  return sides;
}

bool Free(const WallSide& side, double from, double to) {
  constexpr double kCorner = 0.15;  // m
  const auto meets = [&](const DoorwaySpec& d) {
    return from < d.along + 0.5 * d.width + 0.1 && to > d.along - 0.5 * d.width - 0.1;
  };
  return from >= kCorner && to <= side.length - kCorner &&
         std::none_of(side.doorways.begin(), side.doorways.end(), meets);
}

void Hang(const WallSide& side, double along, double height, const Vector2d& size, const std::string& style,
          World* world) {
  PosterSpec poster = side.blank;
  poster.along = along, poster.size = size, poster.texture = {style};
  poster.height = std::min(height, side.height - 0.5 * size.y() - 0.1);
  world->posters.push_back(poster);
}

// Things of one size at equal distances, as an architect does it. Returns where there are none.
std::vector<std::pair<double, double>> HangRow(const WallSide& side, const std::string& style, const Vector2d& size,
                                               double height, double spacing, World* world) {
  std::vector<std::pair<double, double>> taken;
  const int count = static_cast<int>(side.length / spacing);
  for (int i = 0; i < count; ++i) {
    const double along = (i + 0.5) * side.length / count;
    const double from = along - 0.5 * size.x(), to = along + 0.5 * size.x();
    if (!Free(side, from, to)) continue;
    Hang(side, along, height, size, style, world);
    taken.emplace_back(from, to);
  }
  return taken;
}

// Posters, boards and pictures between what is there.
void HangPictures(const WallSide& side, const std::vector<std::pair<double, double>>& taken, double richness,
                  Draws& draws, World* world) {
  constexpr double kMostGap = 25.0;  // m
  for (double along = std::min(kMostGap, draws.Uniform(0.1, 0.9) / richness); along < side.length;) {
    const Vector2d size(draws.Uniform(0.4, 1.2), draws.Uniform(0.5, 1.1));
    const double height = draws.Uniform(1.2, 1.8), from = along, to = along + size.x();
    const auto meets = [&](const std::pair<double, double>& t) {
      return from < t.second + 0.05 && to > t.first - 0.05;
    };
    const std::string style =
        draws.Weighted<const char*>({{3.0, "text"}, {2.0, "photo"}, {2.0, "map"}, {2.0, "shapes"}, {1.0, "board"}});
    if (Free(side, from, to) && std::none_of(taken.begin(), taken.end(), meets))
      Hang(side, 0.5 * (from + to), height, size, style, world);
    along += size.x() + std::min(kMostGap, draws.Uniform(0.2, 1.0) / richness);
  }
}

void HangAll(Building* building, Draws& draws) {
  World& world = building->world;
  // Doors that stay closed and windows repeat along the outer walls; doors are in corridors' blocks, too.
  const double door_spacing = draws.Uniform(3.0, 8.0), window_spacing = draws.Uniform(2.5, 6.0);
  const Vector2d window(draws.Uniform(0.9, 2.0), draws.Uniform(0.9, 1.5)), door(0.95, 2.05);
  for (const WallSide& side : SidesOf(world)) {
    std::vector<std::pair<double, double>> taken;
    if (side.outer && draws.Chance(0.4)) {
      taken = HangRow(side, "window", window, 1.6, window_spacing, &world);
    } else if (draws.Chance(side.doorways.empty() ? 0.5 : 0.0)) {
      taken = HangRow(side, "door", door, 0.5 * door.y(), door_spacing, &world);
    }
    HangPictures(side, taken, building->style.richness, draws, &world);
  }
}

void AddLamps(World* world, Draws& draws) {
  const double spacing = std::max(draws.Uniform(2.8, 4.5), 0.9 * world->room.size.z());
  const Vector2d size(draws.Uniform(0.5, 1.4), draws.Uniform(0.25, 0.6));
  const Vector2d room = world->room.size.head<2>();
  const auto count = [spacing](double length) { return std::max(1, static_cast<int>(std::lround(length / spacing))); };
  const int columns = count(room.x()), rows = count(room.y());
  for (int i = 0; i < columns; ++i) {
    for (int j = 0; j < rows; ++j) {
      const Vector2d at(room.x() * (i + 0.5) / columns, room.y() * (j + 0.5) / rows);
      if (draws.Chance(0.93)) world->lamps.push_back({at, size, 1.0});  // some are broken
    }
  }
}

// From the wall to its outside, rad.
double Outwards(Wall wall) {
  constexpr double kAzimuths[] = {-M_PI_2, 0.0, M_PI_2, M_PI};
  return kAzimuths[static_cast<std::size_t>(wall)];
}

void DrawLight(World* world, Draws& draws) {
  LightSpec& light = world->light;
  light.level = draws.Uniform(0.7, 1.3);
  const auto window = std::find_if(world->posters.begin(), world->posters.end(),
                                   [](const PosterSpec& poster) { return poster.texture.style == "window"; });
  if (window == world->posters.end()) return;
  light.windows = draws.Chance(0.5) ? draws.Uniform(0.2, 1.0) : 0.0;
  if (light.windows == 0.0 || !draws.Chance(0.3)) return;
  light.lamps = draws.Uniform(0.3, 1.0);
  light.sun = draws.Uniform(1.0, 4.0);
  light.sun_azimuth = WrapAngle(Outwards(window->wall) + draws.Uniform(-0.8, 0.8));
  light.sun_elevation = draws.Uniform(0.35, 1.0);
}

}  // namespace

void Decorate(Building* building, Draws& draws) {
  HangAll(building, draws);
  AddLamps(&building->world, draws);
  DrawLight(&building->world, draws);
}

}  // namespace planar_vslam::sim
