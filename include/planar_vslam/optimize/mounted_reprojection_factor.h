#pragma once
// The reprojection factor (reprojection_factor.h) with a correction of how the camera is mounted as a further unknown:
//   T_base_camera' = [Exp(w), d] o T_base_camera:  R' = Exp(w) R,  t' = t + d,   m = [d, w]
//   p_camera = R^T Exp(-w) (p_base - t - d),  e = (pi(p_camera) - u) / sigma
//   dp_camera/dd = -R^T Exp(-w),   dp_camera/dw = R^T [Exp(-w)(p_base - t - d)]_x Jr(w)
// since Exp(w + h) = Exp(w) Exp(Jr(w) h). Pose and point as there, with R^T Exp(-w) in place of R_camera_base.
#include <ceres/ceres.h>

#include "planar_vslam/geometry/rigid3.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam {

// Blocks: pose (7), point (3), mount m (6).
class MountedReprojectionFactor final : public ceres::SizedCostFunction<2, 7, 3, 6> {
 public:
  MountedReprojectionFactor(const Eigen::Vector2d& pixel, const Rigid3& T_base_camera, const CameraModel& camera,
                            double sigma);
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Eigen::Vector2d pixel_;
  Eigen::Matrix3d R_camera_base_;
  Eigen::Vector3d t_base_camera_;
  double fx_, fy_, cx_, cy_, inverse_sigma_;
};

// T_base_camera' of m = [d, w].
Rigid3 Mounted(const Vector6d& mount, const Rigid3& T_base_camera);

}  // namespace planar_vslam
