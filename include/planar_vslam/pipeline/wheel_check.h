#pragma once
// Whether the wheels went where the map says that the robot went, between keyframes.
#include <optional>

#include "planar_vslam/map/map.h"

namespace planar_vslam {

struct Deviation {
  double value = 0.0, sigma = 0.0;  // of the mean
};

struct WheelCheck {
  std::optional<Deviation> turn;       // how much further the wheels say it turned, as a share; of over two radians
  std::optional<Deviation> direction;  // rad, counter-clockwise from where the map says it drove to where the wheels do
};

// Nothing where there are too few links of the kind to tell.
WheelCheck CheckWheels(const Map& map);

}  // namespace planar_vslam
