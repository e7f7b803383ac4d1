#pragma once
// The factors once more, plainly and for any scalar, so that Ceres can differentiate them: what the analytic ones are
// compared with, in value (test/planar, test/optimize) and in time (bench/micro).
#include <ceres/rotation.h>

#include "planar_vslam/geometry/rigid3.h"

namespace planar_vslam::test {

// With plain arrays and quaternions [w x y z].
struct OdometryTwin {
  Rigid3 T_i_j;
  Matrix6d sqrt_information;

  template <class S>
  static void LogOfPose(const S q[4], const S t[3], S xi[6]) {
    S phi[3];
    ceres::QuaternionToAngleAxis(q, phi);
    const S squared = phi[0] * phi[0] + phi[1] * phi[1] + phi[2] * phi[2];
    S c = S(1.0 / 12.0) + squared / 720.0;
    if (squared > S(1e-6)) {
      const S half = sqrt(squared) / 2.0;
      c = (S(1.0) - half * cos(half) / sin(half)) / squared;
    }
    S once[3], twice[3];
    ceres::CrossProduct(phi, t, once);
    ceres::CrossProduct(phi, once, twice);
    for (int k = 0; k < 3; ++k) {
      xi[k] = t[k] - once[k] / 2.0 + c * twice[k];
      xi[3 + k] = phi[k];
    }
  }

  template <class S>
  bool operator()(const S* pose_i, const S* pose_j, S* residuals) const {
    const S q_i_inverse[4] = {pose_i[6], -pose_i[3], -pose_i[4], -pose_i[5]};
    const S q_j[4] = {pose_j[6], pose_j[3], pose_j[4], pose_j[5]};
    const Eigen::Quaterniond& q = T_i_j.rotation;
    const S q_measured_inverse[4] = {S(q.w()), S(-q.x()), S(-q.y()), S(-q.z())};
    const S difference[3] = {pose_j[0] - pose_i[0], pose_j[1] - pose_i[1], pose_j[2] - pose_i[2]};
    S t_i_j[3], t[3], q_i_j[4], q_error[4], xi[6];
    ceres::UnitQuaternionRotatePoint(q_i_inverse, difference, t_i_j);
    ceres::QuaternionProduct(q_i_inverse, q_j, q_i_j);
    for (int k = 0; k < 3; ++k) t_i_j[k] -= T_i_j.translation[k];
    ceres::UnitQuaternionRotatePoint(q_measured_inverse, t_i_j, t);
    ceres::QuaternionProduct(q_measured_inverse, q_i_j, q_error);
    LogOfPose(q_error, t, xi);
    for (int r = 0; r < 6; ++r) {
      residuals[r] = S(0.0);
      for (int k = 0; k < 6; ++k) residuals[r] += sqrt_information(r, k) * xi[k];
    }
    return true;
  }
};

// The third row of the rotation matrix, written out for a quaternion [x y z w] of unit length.
struct PlanarPriorTwin {
  double sigma_height, sigma_tilt;

  template <class S>
  bool operator()(const S* pose, S* residuals) const {
    const S &x = pose[3], &y = pose[4], &z = pose[5], &w = pose[6];
    residuals[0] = pose[2] / sigma_height;
    residuals[1] = 2.0 * (x * z - w * y) / sigma_tilt;
    residuals[2] = 2.0 * (y * z + w * x) / sigma_tilt;
    return true;
  }
};

// For points in front of the camera.
struct ReprojectionTwin {
  Eigen::Vector2d pixel;
  Rigid3 T_camera_base;
  double fx, fy, cx, cy, sigma;

  template <class S>
  bool operator()(const S* pose, const S* point, S* residuals) const {
    const S q_base_map[4] = {pose[6], -pose[3], -pose[4], -pose[5]};
    const S difference[3] = {point[0] - pose[0], point[1] - pose[1], point[2] - pose[2]};
    S p_base[3], p_camera[3];
    ceres::UnitQuaternionRotatePoint(q_base_map, difference, p_base);
    const Eigen::Quaterniond& q = T_camera_base.rotation;
    const S q_camera_base[4] = {S(q.w()), S(q.x()), S(q.y()), S(q.z())};
    ceres::UnitQuaternionRotatePoint(q_camera_base, p_base, p_camera);
    for (int k = 0; k < 3; ++k) p_camera[k] += T_camera_base.translation[k];
    residuals[0] = (fx * p_camera[0] / p_camera[2] + cx - pixel.x()) / sigma;
    residuals[1] = (fy * p_camera[1] / p_camera[2] + cy - pixel.y()) / sigma;
    return true;
  }
};

// Weighted as a whole.
struct PlanarReprojectionTwin {
  ReprojectionTwin reprojection;
  Eigen::Matrix2d whitening;

  template <class S>
  bool operator()(const S* pose, const S* point, S* residuals) const {
    S e[2];
    reprojection(pose, point, e);
    for (int r = 0; r < 2; ++r) residuals[r] = whitening(r, 0) * e[0] + whitening(r, 1) * e[1];
    return true;
  }
};

}  // namespace planar_vslam::test
