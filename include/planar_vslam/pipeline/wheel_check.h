#pragma once
// Whether the wheels went where the map says that the robot went, between keyframes. For people to read: all links
// count alike, so that wheels show that are wrong by more than anybody expected. LearnWheelErrors weighs them, starts
// from what was known before, and leaves out what does not agree with it.
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
