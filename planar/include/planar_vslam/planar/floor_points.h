#pragma once
// Landmarks that lie on the floor. The camera's height over the floor is known from its mount, so the floor seen in the
// right place makes a map metric without wheels, and keeps it level:
//   e = z / sigma  for a landmark p_map = [x, y, z] on the floor,  de/dp = [0, 0, 1] / sigma.
// If wheels read a share k too long, so does the map, and the floor lies k h below z = 0 for a camera at height h.
//
// Which landmarks are on the floor is a matter of the whole: the floor is the level, near z = 0, over the most places.
// Feet of furniture and skirting boards are lines, a floor is an area, so places (squares of the plan) count and not
// landmarks.
#include <ceres/ceres.h>

#include <Eigen/Core>
#include <vector>

namespace planar_vslam {

struct FloorPoints {
  std::vector<std::size_t> indices;  // of the points on the floor, ascending; empty where no floor is seen
  double level = 0.0;                // m, their height as it is in the map
};
// `points` in the map, metres, z up, the base on z = 0.
FloorPoints FindFloorPoints(const std::vector<Eigen::Vector3d>& points);

// Block: point (3). 1 residual.
class FloorPointFactor final : public ceres::SizedCostFunction<1, 3> {
 public:
  explicit FloorPointFactor(double sigma) : sigma_(sigma) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  double sigma_;  // m
};

}  // namespace planar_vslam
