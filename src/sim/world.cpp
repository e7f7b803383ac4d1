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
    case ObjectKind::kShelf:
      return "shelf";
    case ObjectKind::kPillar:
      return "pillar";
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

Rigid3 CameraSpec::T_base_camera() const {
  // Columns: the optical frame's x (right), y (down) and z (forward) axes in the base, then the tilt about its x axis.
  Eigen::Matrix3d R_base_level;
  R_base_level << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const Eigen::AngleAxisd tilt(-tilt_down, Eigen::Vector3d::UnitX());
  return {Eigen::Quaterniond(R_base_level * tilt.toRotationMatrix()), position};
}

Rigid3 LaserSpec::T_base_laser() const { return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, 0.0, height)}; }

}  // namespace planar_vslam
