#pragma once
// Floor and walls in a cloud of map points (RANSAC): whether a map stands level on z = 0, and what bounds it.
#include <Eigen/Core>
#include <optional>
#include <vector>

namespace planar_vslam {

struct PlaneOptions {
  double thickness = 0.05;        // m, points this far on either side belong to a floor
  double floor_reach = 0.40;      // m, a floor is looked for this far above and below z = 0
  double floor_max_tilt_deg = 5;  // deg, of a floor
  int floor_min_points = 50;
  double wall_thickness = 0.10;   // m, and to a wall: points are less certain the farther they are
  double wall_min_height = 0.30;  // m, points below it say more of furniture and floor than of walls
  double wall_max_gap = 1.0;      // m along a wall between two of its points
  double wall_min_length = 1.0;   // m
  double wall_min_rise = 0.5;     // m, from a wall's lowest point to its highest: a table's edge is no wall
  int wall_min_points = 60;
};

struct FloorPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // upwards
  double height = 0.0;                                // m, z of the plane below the points' centroid...
  Eigen::Vector2d center = Eigen::Vector2d::Zero();   // m, ...which is here
  int points = 0;
  double rms = 0.0;  // m, of the points' distances

  double TiltDegrees() const;
  // m, of a point above the plane, along its normal.
  double HeightOf(const Eigen::Vector3d& p) const;
};

// Upright piece of a plane.
struct WallPlane {
  Eigen::Vector2d from = Eigen::Vector2d::Zero(), to = Eigen::Vector2d::Zero();  // m, its ends seen from above
  double bottom = 0.0, top = 0.0;                                                // m, of its points
  int points = 0;
  double rms = 0.0;  // m
};

// Nothing where no floor is seen: too few points, or no more of them in a level plane than above or below it.
std::optional<FloorPlane> FindFloor(const std::vector<Eigen::Vector3d>& points, const PlaneOptions& options);

// By descending number of points. Deterministic.
std::vector<WallPlane> FindWalls(const std::vector<Eigen::Vector3d>& points, const PlaneOptions& options);

}  // namespace planar_vslam
