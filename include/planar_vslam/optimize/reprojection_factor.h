#pragma once
// A landmark seen in a keyframe:  e = (pi(p_camera) - u) / sigma,
//   p_base = R_map_base^T (l - p_map_base),  p_camera = T_camera_base p_base,  pi(p) = (fx x/z + cx, fy y/z + cy).
// With J_pi = [fx/z, 0, -fx x/z^2; 0, fy/z, -fy y/z^2], right perturbation d = [translation, rotation] of T_map_base:
//   de/dl = J_pi R_camera_base R_map_base^T,  de/dd_t = -J_pi R_camera_base,  de/dd_r = J_pi R_camera_base [p_base]_x
// all over sigma. Points at z < 0.05 m give a zero residual with zero Jacobians (the linearisation is void there); the
// caller drops such observations.
#include <ceres/ceres.h>

#include "planar_vslam/geometry/rigid3.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam {

constexpr double kMinDepth = 0.05;  // m or map units

// J_pi of a point in front of the camera: pixels by metres.
inline Eigen::Matrix<double, 2, 3> ProjectionJacobian(const CameraModel& camera, const Eigen::Vector3d& p_camera) {
  const double inverse_z = 1.0 / p_camera.z();
  const double u = p_camera.x() * inverse_z, v = p_camera.y() * inverse_z;
  Eigen::Matrix<double, 2, 3> J;
  J << camera.fx * inverse_z, 0.0, -camera.fx * u * inverse_z, 0.0, camera.fy * inverse_z, -camera.fy * v * inverse_z;
  return J;
}

class ReprojectionFactor final : public ceres::SizedCostFunction<2, 7, 3> {
 public:
  ReprojectionFactor(const Eigen::Vector2d& pixel, const Rigid3& T_base_camera, double fx, double fy, double cx,
                     double cy, double sigma);
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Eigen::Vector2d pixel_;
  Eigen::Matrix3d R_camera_base_;
  Eigen::Vector3d t_camera_base_;
  double fx_, fy_, cx_, cy_, inverse_sigma_;
};

}  // namespace planar_vslam
