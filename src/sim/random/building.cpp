// Sizes, walls and doorways.
#include "building.h"

#include <fmt/format.h>

namespace planar_vslam::sim {
namespace {

constexpr double kThickness = 0.1;  // m, of inner walls

void SetRoom(Building* building, double x, double y, double height) { building->world.room.size = {x, y, height}; }

DoorwaySpec DrawDoorway(double along, Draws& draws) { return {along, draws.Uniform(1.0, 1.3), 2.05}; }

// One zone, all of the building.
Building OneRoom(Use use, double x, double y, double height) {
  Building building;
  SetRoom(&building, x, y, height);
  building.zones.push_back({Area(Vector2d(0.0, 0.0), Vector2d(x, y)), use});
  return building;
}

// Where walls between rooms stand: equal rooms, or jittered.
std::vector<double> Divide(double length, double target, double jitter, Draws& draws) {
  const int count = std::max(1, static_cast<int>(std::lround(length / target)));
  std::vector<double> at = {0.0};
  for (int i = 1; i < count; ++i) at.push_back(length / count * (i + jitter * draws.Uniform(-1.0, 1.0)));
  at.push_back(length);
  return at;
}

// Rooms in a row between y0 and y1, doors to the corridor at `corridor_y`, some doors from room to room.
void AddRooms(Building* building, double y0, double y1, double corridor_y, Draws& draws) {
  const double length = building->world.room.size.x();
  const bool alike = building->style.alike;
  const std::vector<double> walls = Divide(length, draws.Uniform(3.2, 5.5), alike ? 0.0 : 0.15, draws);
  constexpr double kFromCorner = 0.85;  // m, middle of a doorway to a wall, at least
  const double same_place = draws.Uniform(0.0, 1.0);
  std::vector<DoorwaySpec> doorways;
  for (std::size_t i = 0; i + 1 < walls.size(); ++i) {
    const double place = alike ? same_place : draws.Uniform(0.0, 1.0);
    const double along = walls[i] + kFromCorner + place * (walls[i + 1] - walls[i] - 2.0 * kFromCorner);
    const DoorwaySpec doorway = DrawDoorway(along, draws);
    if (draws.Chance(0.9)) doorways.push_back(doorway);
    building->zones.push_back({Area(Vector2d(walls[i], y0), Vector2d(walls[i + 1], y1)), Use::kRoom});
  }
  AddWall(building, {0.0, corridor_y}, {length, corridor_y}, doorways);
  for (std::size_t i = 1; i + 1 < walls.size(); ++i) {
    std::vector<DoorwaySpec> between;
    if (draws.Chance(0.35)) between.push_back(DrawDoorway(draws.Uniform(kFromCorner, y1 - y0 - 1.2), draws));
    AddWall(building, {walls[i], y0}, {walls[i], y1}, between);
  }
}

// A corridor with rooms on one side or both.
Building DrawOffice(bool alike, Draws& draws) {
  Building building;
  building.style.alike = alike;
  const double x = draws.Uniform(14.0, 26.0), corridor = draws.Uniform(1.8, 2.6);
  const double south = draws.Uniform(3.2, 5.2), north = draws.Chance(0.3) ? 0.0 : draws.Uniform(3.2, 5.2);
  SetRoom(&building, x, south + corridor + north, draws.Uniform(2.4, 3.2));
  building.zones.push_back({Area(Vector2d(0.0, south), Vector2d(x, south + corridor)), Use::kPassage});
  AddRooms(&building, 0.0, south, south, draws);
  if (north > 0.0) AddRooms(&building, south + corridor, south + corridor + north, south + corridor, draws);
  return building;
}

// Corridors around blocks that are closed.
Building DrawCorridors(Draws& draws) {
  Building building;
  const double corridor = draws.Uniform(1.6, 2.6);
  const int columns = draws.Whole(1, 3), rows = draws.Whole(1, 2);
  const double block_x = draws.Uniform(5.0, columns == 1 ? 16.0 : 9.0),
               block_y = draws.Uniform(4.0, rows == 1 ? 10.0 : 7.0);
  const auto x = [&](int i) { return corridor + i * (corridor + block_x); };  // west side of a block
  const auto y = [&](int j) { return corridor + j * (corridor + block_y); };  // south side
  SetRoom(&building, x(columns), y(rows), draws.Uniform(2.4, 3.2));
  for (int i = 0; i < columns; ++i) {
    for (int j = 0; j < rows; ++j) {
      const Vector2d low(x(i), y(j)), high(x(i) + block_x, y(j) + block_y);
      AddWall(&building, low, {high.x(), low.y()}, {});
      AddWall(&building, {high.x(), low.y()}, high, {});
      AddWall(&building, high, {low.x(), high.y()}, {});
      AddWall(&building, {low.x(), high.y()}, low, {});
    }
  }
  for (int i = 0; i < columns; ++i) {
    for (int j = 0; j <= rows; ++j) {
      const Vector2d low(x(i), y(j) - corridor);
      building.zones.push_back({Area(low, low + Vector2d(block_x, corridor)), Use::kPassage});
    }
  }
  for (int i = 0; i <= columns; ++i) {
    for (int j = 0; j < rows; ++j) {
      const Vector2d low(x(i) - corridor, y(j));
      building.zones.push_back({Area(low, low + Vector2d(corridor, block_y)), Use::kPassage});
    }
  }
  // A closed door in the westernmost corridor: some rings are none.
  if (draws.Chance(0.25)) {
    const double at = y(0) + draws.Uniform(0.3, 0.7) * block_y;
    AddWall(&building, {0.0, at}, {corridor, at}, {});
  }
  return building;
}

// Parts of different use, side by side, with wide doorways.
Building DrawMixed(Draws& draws) {
  Building building;
  const double x = draws.Uniform(16.0, 28.0), y = draws.Uniform(9.0, 17.0);
  SetRoom(&building, x, y, draws.Uniform(2.8, 4.5));
  const std::vector<double> walls = Divide(x, draws.Uniform(7.0, 11.0), 0.1, draws);
  for (std::size_t i = 0; i + 1 < walls.size(); ++i) {
    const Use use = draws.Weighted<Use>({{1.0, Use::kLab}, {0.8, Use::kHall}, {0.8, Use::kStore}});
    const bool split = draws.Chance(0.45);
    const double middle = split ? y * draws.Uniform(0.4, 0.6) : y;
    building.zones.push_back({Area(Vector2d(walls[i], 0.0), Vector2d(walls[i + 1], middle)), use});
    if (split) {
      building.zones.push_back({Area(Vector2d(walls[i], middle), Vector2d(walls[i + 1], y)), Use::kRoom});
      const double width = walls[i + 1] - walls[i];
      AddWall(&building, {walls[i], middle}, {walls[i + 1], middle},
              {DrawDoorway(draws.Uniform(1.2, width - 1.2), draws)});
    }
    if (i == 0) continue;
    // One doorway on each side of where walls across may end, so that there may be a way round.
    std::vector<DoorwaySpec> doorways;
    for (const double low : {0.0, 0.6 * y}) {
      const double along = low + draws.Uniform(1.3, 0.4 * y - 1.3);
      const double wide = draws.Uniform(1.1, 2.2);
      if (low == 0.0 || draws.Chance(0.6)) doorways.push_back({along, wide, 2.1});
    }
    AddWall(&building, {walls[i], 0.0}, {walls[i], y}, doorways);
  }
  return building;
}

Building DrawPlan(WorldKind kind, bool alike, Draws& draws) {
  switch (kind) {
    case WorldKind::kOffice:
      return DrawOffice(alike, draws);
    case WorldKind::kHall:
      return OneRoom(Use::kHall, draws.Uniform(12.0, 22.0), draws.Uniform(14.0, 32.0), draws.Uniform(3.5, 6.0));
    case WorldKind::kCorridor:
      return DrawCorridors(draws);
    case WorldKind::kWarehouse:
      return OneRoom(Use::kStore, draws.Uniform(12.0, 24.0), draws.Uniform(14.0, 28.0), draws.Uniform(4.0, 7.0));
    case WorldKind::kMixed:
      return DrawMixed(draws);
    case WorldKind::kLab:
      break;
  }
  return OneRoom(Use::kLab, draws.Uniform(7.5, 14.0), draws.Uniform(7.0, 11.0), draws.Uniform(2.5, 3.4));
}

TextureSpec Shaded(const std::string& style, double low, double high, Draws& draws) {
  return {style, static_cast<int>(std::lround(draws.Uniform(low, high)))};
}

void DrawSurfaces(Building* building, Draws& draws) {
  using Name = const char*;
  RoomSpec& room = building->world.room;
  room.floor =
      Shaded(draws.Weighted<Name>({{1.5, "plain"}, {3, "tiles"}, {2.5, "planks"}, {3, "fabric"}}), 90, 190, draws);
  room.walls = Shaded(draws.Weighted<Name>({{6, "plaster"}, {1.5, "plain"}, {2, "brick"}}), 150, 225, draws);
  room.ceiling = Shaded(draws.Weighted<Name>({{6, "panels"}, {2, "plain"}, {2, "plaster"}}), 180, 225, draws);
  room.skirting = draws.Chance(0.7) ? draws.Uniform(0.05, 0.12) : 0.0;
  room.ambient = draws.Uniform(0.25, 0.5);
  room.gloss = draws.Chance(0.4) ? 0.0 : draws.LogUniform(0.01, 0.3);
  room.roughness = draws.LogUniform(0.4, 3.0) * M_PI / 180.0;
}

void DrawStyle(Building* building, bool alike, Draws& draws) {
  Style& style = building->style;
  style.alike = alike;
  style.richness = draws.LogUniform(0.04, 1.0);
  style.clutter = draws.Uniform(0.0, 1.0);
  style.furniture = Shaded("wood", 80, 190, draws);
}

}  // namespace

void AddWall(Building* building, const Vector2d& from, const Vector2d& to, const std::vector<DoorwaySpec>& doorways) {
  ObjectSpec wall;
  wall.kind = ObjectKind::kWall;
  wall.at = 0.5 * (from + to);
  wall.yaw = std::atan2(to.y() - from.y(), to.x() - from.x());
  wall.size = {(to - from).norm(), kThickness};
  wall.height = building->world.room.size.z();
  wall.name = fmt::format("wall_{}", building->world.objects.size());
  wall.doorways = doorways;
  const Vector2d along = (to - from).normalized();
  for (const DoorwaySpec& doorway : doorways) {
    building->openings.push_back({from + doorway.along * along, {-along.y(), along.x()}, doorway.width});
  }
  building->world.objects.push_back(wall);
}

Building DrawBuilding(WorldKind kind, Draws& draws) {
  const bool alike = draws.Chance(0.5);
  Building building = DrawPlan(kind, alike, draws);
  DrawStyle(&building, alike, draws);
  DrawSurfaces(&building, draws);
  for (ObjectSpec& wall : building.world.objects) {
    wall.texture = draws.Chance(alike ? 0.0 : 0.2) ? TextureSpec{"brick"} : building.world.room.walls;
  }
  return building;
}

}  // namespace planar_vslam::sim
