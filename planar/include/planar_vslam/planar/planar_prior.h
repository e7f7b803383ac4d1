#pragma once
// What a floor says of the base, in one of these forms (planar/README.md compares them):
//   soft_se3  poses of 6 dof, held near the floor by the prior below;
//   se2_xyz   poses of 3 dof on the floor, pixels uncertain by what height and tilt do (planar_reprojection_factor.h);
//   hard      poses of 3 dof on the floor, pixels as they are: for comparison.
// Where the floor monitor has released the floor, every form leaves a pose its 6 dof and says no more of it than that a
// base stands upright within what ramps are: the prior below with sigma_slope for tilt and nothing of height. It bends
// no slope that is seen; where the camera saw nothing and the tilt was lost, nothing else tells it.
//
// The soft prior on one base pose (optional SE(2) prior): height and tilt over the plane z = 0 of the map.
//   e = [ z / sigma_z,  u_x / sigma_tilt,  u_y / sigma_tilt ],  u = R_map_base^T e_z   (u_x, u_y = -sin pitch, ~ roll)
// Jacobians for right perturbations d = [translation, rotation]:
//   dz/d_t = e_z^T R,   du/d_r = [u]_x (first two rows).
#include <ceres/ceres.h>

#include <limits>
#include <string>
#include <vector>

#include "planar_vslam/geometry/option_fields.h"
#include "planar_vslam/geometry/rigid3.h"

namespace planar_vslam {

enum class PlanarMode { kOff, kSoftSe3, kSe2Xyz, kHard };

// Whether poses on the floor have 3 dof.
inline bool IsPlanar(PlanarMode mode) { return mode == PlanarMode::kSe2Xyz || mode == PlanarMode::kHard; }

struct PlanarPriorOptions {
  PlanarMode mode = PlanarMode::kSoftSe3;
  double sigma_height = 0.01;
  double sigma_tilt = DegreesToRadians(0.5);
  double sigma_slope = DegreesToRadians(5.0);  // a ramp for wheelchairs, 1 in 12, is one sigma
  bool floor_points = false;                   // floor_points.h
  double sigma_floor_point = 0.03;             // flatness, and how well the landmark is seen

  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    v("mode", o.mode,
      {{"soft_se3", PlanarMode::kSoftSe3},
       {"se2_xyz", PlanarMode::kSe2Xyz},
       {"hard", PlanarMode::kHard},
       {"off", PlanarMode::kOff}},
      "soft_se3 (a prior), se2_xyz (3 dof, pixels inflated), hard (3 dof) or off");
    v("sigma_height", o.sigma_height, unit::kMeters, bound::Positive(), "of the base over the floor");
    v("sigma_tilt_deg", o.sigma_tilt, unit::kDegrees, bound::Positive(), "roll and pitch each");
    v("sigma_slope_deg", o.sigma_slope, unit::kDegrees, bound::Positive(),
      "roll and pitch each of a base that has left the floor");
    v("floor_points", o.floor_points, "landmarks on the floor hold it at the height the camera's mount says");
    v("sigma_floor_point", o.sigma_floor_point, unit::kMeters, bound::Positive(), "of such a landmark's height");
  }
  std::vector<std::string> Problems() const { return ProblemsOf(*this); }
};

// What the prior says of a base. Of a height it knows nothing: infinity.
struct FloorSigmas {
  double height = 0.0;  // m
  double tilt = 0.0;    // rad
};
inline FloorSigmas FloorSigmasOf(const PlanarPriorOptions& planar, bool on_floor) {
  if (on_floor) return {planar.sigma_height, planar.sigma_tilt};
  return {std::numeric_limits<double>::infinity(), planar.sigma_slope};
}

// Whitened residual and, where not null, its 3x6 Jacobian with respect to the right perturbation.
Eigen::Vector3d PlanarPriorResidual(const Rigid3& T_map_base, const FloorSigmas& sigmas,
                                    Eigen::Matrix<double, 3, 6>* J);

// Block: pose (7), see pose_manifold.h. 3 residuals.
class PlanarPriorFactor final : public ceres::SizedCostFunction<3, 7> {
 public:
  explicit PlanarPriorFactor(const FloorSigmas& sigmas) : sigmas_(sigmas) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  FloorSigmas sigmas_;
};

}  // namespace planar_vslam
