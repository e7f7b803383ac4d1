#pragma once
// Whether the base is on the plane the floor prior assumes. Ramps, door sills and streets are not: a prior that is held
// against the evidence bends the map. Each keyframe's pose, estimated without the prior, is tested against the plane:
//   e = [z, u_x, u_y]  (planar_prior.h) over [sigma_z, sigma_tilt, sigma_tilt],  S = J C J^T + I
// with the pose covariance C, and against the pose about a metre of way before it, both tilts turned to the map's axes:
//   e' = e_now - e_before,  S' = S_now + S_before.
// d^2 = e^T S^-1 e and d'^2 are chi-square with 3 dof on the floor. A map bends slowly by itself, which passes any
// narrow limit on d^2 in time but none on d'^2; a ramp or sill passes d'^2 at once, a street of slow grades only a wide
// d^2.
// On a slope the height drifts with the tilt's errors. After a way s on slopes S has (s sigma_tilt)^2 added for the
// height when it is asked whether the base is back, but never so much that a height which would release the floor
// passes.
//
// A release is noticed late: the prior has bent what was mapped since the ramp's foot by then, so it is withdrawn from
// the poses of the last metre as well.
#include <deque>
#include <optional>

#include "planar_vslam/geometry/rigid3.h"
#include "planar_vslam/sensor/timestamp.h"

namespace planar_vslam {

// A pose estimated without the floor prior, against the plane.
struct FloorReading {
  Timestamp stamp;
  Eigen::Vector3d error = Eigen::Vector3d::Zero();           // e, tilt in the map's axes
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  // S, likewise
  Eigen::Vector2d place = Eigen::Vector2d::Zero();           // m, x and y in the map
  double drift = 0.0;                                        // 1/m, sigmas of height after a metre tilted by one sigma

  double SquaredDistance() const;
};
FloorReading ReadFloor(Timestamp stamp, const Rigid3& T_map_base, const Matrix6d& covariance, double sigma_height,
                       double sigma_tilt);

class FloorMonitor {
 public:
  // Takes the next pose. Released after three in a row whose d' is beyond 7 sigma or whose d is beyond 11; on the floor
  // again after five in a row whose d, with the height's drift, is within the 90 % limit. When it is released just now,
  // the time from which on poses should not be held to the floor.
  std::optional<Timestamp> Add(const FloorReading& reading);
  bool on_floor() const { return on_floor_; }

 private:
  struct Step {
    FloorReading reading;
    double way = 0.0;  // m, driven up to here
  };
  double WayTo(const FloorReading& reading) const;
  // d'^2; for the first metre against the floor itself, on which a map begins.
  double ChangeSquared(const FloorReading& reading) const;
  // Off the floor: whether it stands on it all the same, given what the height has drifted by.
  bool Returns(FloorReading reading);

  std::deque<Step> way_;  // of the last metres
  bool on_floor_ = true;
  double sloped_ = 0.0;  // m, driven on slopes since it was left
  int streak_ = 0;       // readings in a row that speak against the present state
};

}  // namespace planar_vslam
