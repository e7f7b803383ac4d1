#include "planar_vslam/sim/world.h"

#include "planar_vslam/geometry/check.h"

namespace planar_vslam {

const std::vector<std::string>& SurfaceStyles() {
  static const std::vector<std::string> styles = {"plain",  "plaster", "brick",  "tiles",
                                                  "planks", "wood",    "fabric", "panels"};
  return styles;
}

const std::vector<std::string>& PictureStyles() {
  static const std::vector<std::string> styles = {"text", "shapes", "map", "photo", "board", "books", "door", "window"};
  return styles;
}

const char* Name(ObjectKind kind) {
  switch (kind) {
    case ObjectKind::kBox:
      return "box";
    case ObjectKind::kTable:
      return "table";
    case ObjectKind::kChair:
      return "chair";
    case ObjectKind::kSwivelChair:
      return "swivel_chair";
    case ObjectKind::kShelf:
      return "shelf";
    case ObjectKind::kPillar:
      return "pillar";
    case ObjectKind::kWall:
      return "wall";
    case ObjectKind::kRamp:
      return "ramp";
  }
  PV_CHECK(false, "object kind " << static_cast<int>(kind));
}

const char* Name(Wall wall) {
  switch (wall) {
    case Wall::kSouth:
      return "south";
    case Wall::kEast:
      return "east";
    case Wall::kNorth:
      return "north";
    case Wall::kWest:
      return "west";
  }
  PV_CHECK(false, "wall " << static_cast<int>(wall));
}

}  // namespace planar_vslam
