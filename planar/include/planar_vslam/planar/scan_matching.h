#pragma once
// Motion of the base between two laser sweeps: point-to-line ICP (Censi, 2008, with a robust kernel in place of its
// trimming), made symmetric (Rusinkiewicz, 2019). Every point stands for its surface: the mean q_k of its
// neighbourhood, with a normal m_k. For the reference surface (mean s, normal n) nearest to T q_k:
//   e_k = u^T (T q_k - s),  u = (n + R m_k) / |n + R m_k|,   T <- T Exp(d):  de_k/dd = u^T R [ I, J q_k ],
//   J = [0 -1; 1 0], u held fixed in a step.
// Normals point to where the laser stood: the two faces of a wall, which the robot sees before and after a door, are no
// one surface. Means and both normals make a round pillar, of which each sweep sees the front, no obstacle to being
// right: the curvature enters both surfaces alike and cancels. Tukey weights bound what one pair pulls. Covariance of a
// right perturbation [x, y, angle] at the result:
//   C = 2 sigma^2 (sum w_k g_k g_k^T)^-1,  g_k = de_k/dd,  sigma the larger of the beams' and the
//   residuals', of both sweeps;
// directions no surface faces (a bare corridor's) come out as uncertain as they are.
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/geometry/option_fields.h"
#include "planar_vslam/geometry/rigid2.h"
#include "planar_vslam/geometry/rigid3.h"
#include "planar_vslam/planar/preintegration.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

struct ScanMatchOptions {
  bool enabled = true;  // the key `match`
  double range_sigma = 0.015;
  double max_offset = 0.30;
  double min_share = 0.60;
  int min_points = 60;
  MotionFloor floor;  // of a match: its two sweeps are skewed by the robot's motion, and see no quite level room

  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    v("match", o.enabled, "false: the laser only draws the map");
    v("range_sigma", o.range_sigma, unit::kMeters, bound::Positive(), "of one range");
    v("max_offset", o.max_offset, unit::kMeters, bound::Positive(), "that a surface may seem off before matching");
    v("min_share", o.min_share, unit::kNone, bound::Between(0.0, 1.0),
      "of a sweep's points that must lie on surfaces of the other");
    v("min_points", o.min_points, unit::kNone, bound::AtLeast(10), "of a sweep that can be matched");
    v("position_floor", o.floor.position, unit::kMeters, bound::Positive(), "of any match");
    v("heading_floor_deg", o.floor.heading, unit::kDegrees, bound::Positive(), "of any match");
  }
  std::vector<std::string> Problems() const { return ProblemsOf(*this); }
};

// A sweep as matching wants it: the points it hit, in the frame asked for, and the surfaces they lie on.
struct ScanSurface {
  Eigen::Vector2d point = Eigen::Vector2d::Zero();  // mean of the neighbourhood
  // Unit length, towards the laser; zero where the neighbourhood is no line.
  Eigen::Vector2d normal = Eigen::Vector2d::Zero();
};
struct PreparedScan {
  std::vector<Eigen::Vector2d> points;  // in the order of the beams
  std::vector<ScanSurface> surfaces;    // one a point
};
// Points of the returns, in the frame `T_frame_laser` leads to, projected onto its x-y plane.
PreparedScan PrepareScan(const PlanarScan& scan, const Rigid3& T_frame_laser, const ScanMatchOptions& options);

struct ScanMatch {
  Rigid2 T_reference_current;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  // of a right perturbation [x, y, angle]
  double share = 0.0;                                        // of the current points that lie on reference surfaces
  double rms = 0.0;                                          // m, of those points
};
// With its covariance in the frame of the reference. `seconds`: between the two sweeps.
PlanarMotion MotionOf(const ScanMatch& match, double seconds);
// Nothing where the sweeps are too small, overlap too little or do not settle.
std::optional<ScanMatch> MatchScans(const PreparedScan& reference, const PreparedScan& current, const Rigid2& guess,
                                    const ScanMatchOptions& options);

}  // namespace planar_vslam
