#pragma once
// A way through a building, from place to place.
#include <optional>
#include <vector>

#include "draws.h"
#include "free_space.h"

namespace planar_vslam::sim {

enum class RouteStyle {
  kRounds,     // the same round again and again: loops
  kWander,     // anywhere, also where it was before
  kBackAgain,  // somewhere, and the same way back
  kOneWay      // where it was not before, as far as the building lets it
};

struct RouteWish {
  RouteStyle style = RouteStyle::kWander;
  double length = 60.0;     // m
  double clearance = 0.35;  // m, of the robot's middle
};

// Corners of the way, the start first. None where too little floor is free.
std::optional<std::vector<Eigen::Vector2d>> DrawRoute(const FreeSpace& space, const RouteWish& wish, Draws& draws);

// The beginning of a line of corners, of that length; all of it where it is shorter.
std::vector<Eigen::Vector2d> CutTo(const std::vector<Eigen::Vector2d>& line, double length);
double LengthOf(const std::vector<Eigen::Vector2d>& line);

}  // namespace planar_vslam::sim
