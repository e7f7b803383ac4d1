#pragma once
// Whether the base is on the plane the floor prior assumes. Ramps, door sills and streets are not: a prior that is held
// against the evidence bends the map. Each keyframe's pose, estimated without the prior, is tested against it:
//   e = [z, u_x, u_y]  (planar_prior.h, unwhitened),  d^2 = e^T (J C J^T + diag(sigma_z^2, sigma_tilt^2,
//   sigma_tilt^2))^-1 e
// with the pose covariance C; d^2 is chi-square with 3 dof on the floor.
#include "planar_vslam/geometry/rigid3.h"

namespace planar_vslam {

// d^2 of a pose estimated without the floor prior.
double FloorDistance(const Rigid3& T_map_base, const Matrix6d& covariance, double sigma_height, double sigma_tilt);

class FloorMonitor {
 public:
  // Takes the next d^2; released after three in a row beyond 7 sigma, on the floor again after ten in a row
  // within the 90 % limit.
  void Add(double squared_distance);
  bool on_floor() const { return on_floor_; }

 private:
  bool on_floor_ = true;
  int streak_ = 0;  // readings in a row that speak against the present state
};

}  // namespace planar_vslam
