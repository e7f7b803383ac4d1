#pragma once
// How far wheels that read wrong throughout have led a pose astray since it was confirmed. Noise adds up as its square
// root; a share b of every way and a share c of every turn add up in full:
//   J <- Ad(T_i_j^-1) J + [R_i_j^T t_i_j, 0; 0, phi_i_j],   Sigma = J diag(sigma_b^2, sigma_c^2) J^T
// of a right perturbation [x, y, angle] at the pose. And wheels slip now and then, which turns the robot: a variance of
// heading for each metre, carried along likewise.
#include <Eigen/Core>

#include "planar_vslam/optimize/map_uncertainty.h"
#include "planar_vslam/planar/preintegration.h"

namespace planar_vslam {

class BlindDrift {
 public:
  explicit BlindDrift(const SystematicErrors& errors) : sigmas_(errors.wheels, errors.turn) {}

  void Move(const Rigid2& T_i_j);
  // The pose was confirmed.
  void Forget() {
    by_errors_.setZero();
    by_slips_.setZero();
  }
  Eigen::Matrix3d Covariance() const;

 private:
  Eigen::Vector2d sigmas_;
  Eigen::Matrix<double, 3, 2> by_errors_ = Eigen::Matrix<double, 3, 2>::Zero();  // J
  Eigen::Matrix3d by_slips_ = Eigen::Matrix3d::Zero();
};

}  // namespace planar_vslam
