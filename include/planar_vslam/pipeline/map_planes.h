#pragma once
// Floor and walls among a map's landmarks: whether the map stands level on z = 0, and what bounds it.
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/map/map.h"
#include "planar_vslam/mapping2d/planes.h"

namespace planar_vslam {

struct MapPlanes {
  std::optional<FloorPlane> floor;  // absent where the landmarks show none
  std::vector<WallPlane> walls;
};

// Nothing for a map that is not metric.
MapPlanes PlanesOf(const Map& map, const PlaneOptions& options);

// One line: height and tilt of the floor against z = 0, or that none is seen.
std::string FloorText(const std::optional<FloorPlane>& floor);

}  // namespace planar_vslam
