#pragma once
// How uncertain keyframes' poses are in their map, whose origin is the first keyframe: [x, y, heading], right
// perturbations in the base. Bundle adjustment gives poses given the map around; what the map itself has drifted comes
// from all that ties keyframes together (map_ties.h). Each tie between keyframes i and j is a relative pose with
// information W, and with  e = Log(T_i_j^-1 T_map_i^-1 T_map_j),  de/dd_j = I,  de/dd_i = -Ad(T_i_j^-1):
//   H = sum J^T W J,  the first keyframe fixed;  covariances are blocks of H^-1.
// What wheels and laser each read long throughout, a share b of every motion they measured, and what wheels turn too
// far, a share c, are unknowns of H beside the poses, with  de/db = -R_i_j^T t_i_j,  de/dc = -[0, 0, phi_i_j]  and a
// prior of their own. Images do not know how long a way is, and what they make of it drifts with the landmarks from tie
// to tie: between keyframes a way t apart their ties count for nothing along it, W^-1 grows by t t^T. Where a loop is
// closed they do: there what the map is like between two keyframes is told, not how far it is from the truth.
#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/geometry/option_fields.h"
#include "planar_vslam/map/map.h"
#include "planar_vslam/optimize/map_ties.h"

namespace planar_vslam {

// Shares by which a source of motion may read wrong throughout. That of the wheels is between that of random worlds 1
// to 12, whose maps are 1 % off without a laser, and of the recorded drives, with half a percent.
struct SystematicErrors {
  double wheels = 0.0075;
  double laser = 0.0005;
  double turn = 0.02;
  bool learn = true;

  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    v("wheels", o.wheels, unit::kNone, bound::Positive(), "of the wheels' ways, before anything is learned of them",
      Origin::kFitted);
    v("laser", o.laser, unit::kNone, bound::Positive(), "of the laser, whose metre is its clock", Origin::kFitted);
    v("turn", o.turn, unit::kNone, bound::Positive(), "of the wheels' turns, before anything is learned of them");
    v("learn", o.learn, "what the wheels read wrong is learned while a map grows, and corrected");
  }
  std::vector<std::string> Problems() const { return ProblemsOf(*this); }
};

class MapUncertainty {
 public:
  // `map` metric, with a keyframe.
  MapUncertainty(const Map& map, const std::vector<MapTie>& ties, const SystematicErrors& systematic);

  // Zero for the first keyframe.
  Eigen::Matrix3d CovarianceOf(KeyframeId id) const;
  // Of where `to` stands as `from` sees it.
  Eigen::Matrix3d CovarianceBetween(KeyframeId from, KeyframeId to) const;
  // Standard deviation of log(s), s the scale that fits the map to the true places p_k of its keyframes best:
  //   log s = sum (p_k - c)^T dp_k / sum |p_k - c|^2,   c their mean, dp_k the errors.
  // Stretches of the map err by scales of their own: it is their mean's, and in it what is systematic. Nothing where
  // all keyframes are at one place.
  std::optional<double> ScaleSigma() const;

 private:
  Eigen::MatrixXd Columns(const std::vector<Eigen::Index>& blocks) const;

  IdMap<KeyframeId, Rigid2> poses_;
  Eigen::Index size_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;  // of H
};

}  // namespace planar_vslam
