#pragma once
// Pinhole camera with the plumb_bob (Brown-Conrady) distortion of sensor_msgs/CameraInfo and OpenCV.
#include <Eigen/Core>
#include <string>
#include <vector>

namespace planar_vslam {

struct CameraModel {
  int width = 0;                                            // px
  int height = 0;                                           // px
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;            // px
  double k1 = 0.0, k2 = 0.0, p1 = 0.0, p2 = 0.0, k3 = 0.0;  // plumb_bob, dimensionless

  // One line for each thing that makes the model unusable; empty when it is usable.
  std::vector<std::string> Problems() const;

  bool distorted() const { return k1 != 0.0 || k2 != 0.0 || p1 != 0.0 || p2 != 0.0 || k3 != 0.0; }

  // Point in the optical frame (z forward, z > 0) -> pixel of the ideal, undistorted camera with the same fx fy cx cy.
  Eigen::Vector2d ProjectUndistorted(const Eigen::Vector3d& p_camera) const {
    return {fx * p_camera.x() / p_camera.z() + cx, fy * p_camera.y() / p_camera.z() + cy};
  }
  // Point in the optical frame -> pixel of the real image.
  Eigen::Vector2d Project(const Eigen::Vector3d& p_camera) const;
  // Ideal pixel <-> pixel of the real image. UndistortPixel iterates to 1e-9 px or 20 rounds.
  Eigen::Vector2d DistortPixel(const Eigen::Vector2d& ideal_px) const;
  Eigen::Vector2d UndistortPixel(const Eigen::Vector2d& image_px) const;
  // Ray of an ideal pixel in the optical frame, z = 1.
  Eigen::Vector3d Ray(const Eigen::Vector2d& ideal_px) const {
    return {(ideal_px.x() - cx) / fx, (ideal_px.y() - cy) / fy, 1.0};
  }
};

}  // namespace planar_vslam
