#pragma once
// What a low laser passes below: horizontal faces found in map points, filled by their concave hull.
#include <Eigen/Core>
#include <string>
#include <vector>

namespace planar_vslam {

struct OverhangOptions {
  bool enabled = true;
  double min_height = 0.30;    // m, a face lower than this has sides that points or laser see
  double max_height = 1.30;    // m, the robot's height
  double thickness = 0.04;     // m, points this far above or below belong to the face: their height's sigma
  double neighborhood = 0.40;  // m, around a point, within which it has to lie in a level patch
  double max_tilt_deg = 40.0;  // of that patch: below it a face, above it a side
  double max_gap = 0.60;       // m between points that is filled: no planner leads a robot through
  int min_points = 8;          // of a face
  int min_sight_lines = 3;     // that pass where a face would be: there is none

  std::vector<std::string> Problems() const;
};

struct Overhang {
  double height = 0.0;                                 // m
  std::vector<std::vector<Eigen::Vector2d>> outlines;  // closed loops; inside is what an odd number of them encloses
  bool Contains(const Eigen::Vector2d& p) const;
};

// Faces by descending number of points. Deterministic.
std::vector<Overhang> FindOverhangs(const std::vector<Eigen::Vector3d>& points, const OverhangOptions& options);

}  // namespace planar_vslam
