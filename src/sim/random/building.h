#pragma once
// A building on its way to a world: what its rooms are for, and where one gets from one to the next.
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "draws.h"
#include "planar_vslam/sim/random_world.h"

namespace planar_vslam::sim {

using Eigen::Vector2d;
using Area = Eigen::AlignedBox2d;  // m, on the floor

enum class Use { kLab, kHall, kStore, kRoom, kPassage };

// A rectangle with walls around it, or a piece of a corridor with walls along it.
struct Zone {
  Area area;
  Use use = Use::kRoom;
};

// A doorway one drives through.
struct Opening {
  Vector2d at = Vector2d::Zero();       // m
  Vector2d across = Vector2d::UnitX();  // the way through
  double width = 1.0;                   // m
};

// What repeats all over the building.
struct Style {
  bool alike = false;     // rooms, aisles and furniture look the same
  double richness = 1.0;  // 1: a picture every metre or two of wall; 0.04: hardly any
  double clutter = 0.5;   // share of the things that may stand around
  TextureSpec furniture;
};

struct Building {
  World world;
  Style style;
  std::vector<Zone> zones;
  std::vector<Opening> openings;
};

// Walls, doorways and surfaces of a building of that kind.
Building DrawBuilding(WorldKind kind, Draws& draws);

// An inner wall; the doorways become openings.
void AddWall(Building* building, const Vector2d& from, const Vector2d& to, const std::vector<DoorwaySpec>& doorways);

// Things that stand fixed, which the drive has to go round.
void Furnish(Building* building, Draws& draws);

// Pictures, windows, doors, lamps and light.
void Decorate(Building* building, Draws& draws);

}  // namespace planar_vslam::sim
