#pragma once
// The solid things of a world: upright prisms with convex footprints. Camera, laser, grid and drive all see these, but
// to grid and drive what the robot can drive on is no obstacle.
#include <Eigen/Core>
#include <vector>

#include "planar_vslam/sim/world.h"

namespace planar_vslam {

struct Prism {
  std::vector<Eigen::Vector2d> footprint;  // m, world, counter-clockwise, convex
  double bottom = 0.0;                     // m
  double top = 0.0;                        // m
  TextureSpec texture;
  int object = 0;                   // index in World::objects
  bool is_floor = false;            // to be driven on
  std::vector<double> corner_tops;  // m, where the top slopes: of each corner of a rectangular footprint

  // Whether it is an obstacle between the two heights.
  bool MeetsBand(double low, double high) const { return !is_floor && bottom < high && top > low; }
  double TopAt(const Eigen::Vector2d& at) const;  // m
};

// All prisms of all objects, in the order of the objects.
std::vector<Prism> MakeSolids(const std::vector<ObjectSpec>& objects);

// From a point to a convex counter-clockwise polygon; 0 inside. Metres.
double Distance(const Eigen::Vector2d& point, const std::vector<Eigen::Vector2d>& polygon);

// Whether the polygon and the axis-aligned square [min, min + side] share area (touching does not count).
bool OverlapsSquare(const std::vector<Eigen::Vector2d>& polygon, const Eigen::Vector2d& min, double side);

// What the robot's body would hit lies in this band of height.
constexpr double kBodyLow = 0.05;   // m
constexpr double kBodyHigh = 1.30;  // m

}  // namespace planar_vslam
