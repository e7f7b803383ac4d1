#pragma once
// What a low laser passes below: horizontal faces found in map points, filled by their concave hull.
#include <Eigen/Core>
#include <string>
#include <vector>

#include "planar_vslam/geometry/option_fields.h"

namespace planar_vslam {

struct OverhangOptions {
  bool enabled = true;
  double min_height = 0.30;  // a face lower than this has sides that points or laser see
  double max_height = 1.30;  // the robot's height
  double thickness = 0.04;   // the sigma of a point's height
  double neighborhood = 0.40;
  double max_tilt = DegreesToRadians(40.0);  // below it a face, above it a side
  double max_gap = 0.60;                     // no planner leads a robot through
  int min_points = 8;
  int min_sight_lines = 3;

  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    v("overhang_enabled", o.enabled, "table tops: horizontal faces of points, filled");
    v("overhang_min_height", o.min_height, unit::kMeters, bound::Positive(), "of a face");
    v("overhang_max_height", o.max_height, unit::kMeters, bound::MoreThan("overhang_min_height", o.min_height),
      "of a face");
    v("overhang_thickness", o.thickness, unit::kMeters, bound::Positive(),
      "how far a face's points lie above or below it");
    v("overhang_neighborhood", o.neighborhood, unit::kMeters, bound::Positive(),
      "around a point, within which it lies in a level patch");
    v("overhang_max_tilt_deg", o.max_tilt, unit::kDegrees, bound::Positive().And(bound::AtMost(45.0)), "of that patch");
    v("overhang_max_gap", o.max_gap, unit::kMeters, bound::Positive(), "between points, that is filled");
    v("overhang_min_points", o.min_points, unit::kNone, bound::AtLeast(3), "of a face");
    v("overhang_min_sight_lines", o.min_sight_lines, unit::kNone, bound::AtLeast(1),
      "to points, through where a face would be: there is none");
  }
  std::vector<std::string> Problems() const { return ProblemsOf(*this); }
};

struct Overhang {
  double height = 0.0;                                 // m
  std::vector<std::vector<Eigen::Vector2d>> outlines;  // closed loops; inside is what an odd number of them encloses
  bool Contains(const Eigen::Vector2d& p) const;
};

// Faces by descending number of points. Deterministic.
std::vector<Overhang> FindOverhangs(const std::vector<Eigen::Vector3d>& points, const OverhangOptions& options);

}  // namespace planar_vslam
