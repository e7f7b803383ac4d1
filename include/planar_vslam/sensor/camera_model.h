#pragma once
// Camera with the lenses of sensor_msgs/CameraInfo and OpenCV: plumb_bob (Brown-Conrady), rational_polynomial and
// equidistant (fisheye). The estimator works on ideal pixels: those of a pinhole camera with the same fx fy cx cy.
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace planar_vslam {

// With r2 = x^2 + y^2 of the point (x, y) on the plane z = 1, and theta its angle to the optical axis:
//   kRadial       radial factor (1 + k1 r2 + k2 r2^2 + k3 r2^3) / (1 + k4 r2 + k5 r2^2 + k6 r2^3), and p1, p2
//   kEquidistant  theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8) from the centre, and no p1, p2
enum class Lens { kRadial = 0, kEquidistant = 1 };

struct CameraModel {
  int width = 0;                                            // px
  int height = 0;                                           // px
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;            // px
  double k1 = 0.0, k2 = 0.0, p1 = 0.0, p2 = 0.0, k3 = 0.0;  // plumb_bob, dimensionless
  double k4 = 0.0, k5 = 0.0, k6 = 0.0;                      // rational_polynomial's; k4 also equidistant's
  Lens lens = Lens::kRadial;

  // One line for each thing that makes the model unusable; empty when it is usable. A lens may have no ray for some
  // pixels of the corners.
  std::vector<std::string> Problems() const;

  bool distorted() const;

  // Point in the optical frame (z forward, z > 0) -> pixel of the ideal, undistorted camera with the same fx fy cx cy.
  Eigen::Vector2d ProjectUndistorted(const Eigen::Vector3d& p_camera) const {
    return {fx * p_camera.x() / p_camera.z() + cx, fy * p_camera.y() / p_camera.z() + cy};
  }
  // Point in the optical frame -> pixel of the real image.
  Eigen::Vector2d Project(const Eigen::Vector3d& p_camera) const;
  // Ideal pixel <-> pixel of the real image. UndistortPixel iterates to 1e-9 px; nothing where the lens has no ray for
  // the pixel, or one of more than 70 degrees to the optical axis: there a pixel of a fisheye is two ideal ones across
  // and eight along the radius, and would be taken for far more exact than it is.
  Eigen::Vector2d DistortPixel(const Eigen::Vector2d& ideal_px) const;
  std::optional<Eigen::Vector2d> UndistortPixel(const Eigen::Vector2d& image_px) const;
  // Ray of an ideal pixel in the optical frame, z = 1.
  Eigen::Vector3d Ray(const Eigen::Vector2d& ideal_px) const {
    return {(ideal_px.x() - cx) / fx, (ideal_px.y() - cy) / fy, 1.0};
  }
};

}  // namespace planar_vslam
