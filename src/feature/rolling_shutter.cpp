#include "planar_vslam/feature/rolling_shutter.h"

#include <cmath>

#include "planar_vslam/geometry/rigid3.h"

namespace planar_vslam {

FrameFeatures WithoutRolling(FrameFeatures features, const CameraModel& camera, const Eigen::Vector3d& turn_rate,
                             double readout) {
  constexpr double kMostTurned = 0.2;  // rad while an image is read: what says more is wrong
  constexpr double kInFront = 0.1;     // of a ray whose z was 1
  if (turn_rate.norm() * std::abs(readout) > kMostTurned) return features;
  const double seconds_a_row = readout / camera.height;
  for (Keypoint& keypoint : features.keypoints) {
    const double dt = seconds_a_row * (static_cast<double>(keypoint.raw_pixel.y()) - 0.5 * camera.height);
    const Eigen::Vector3d ray((static_cast<double>(keypoint.pixel.x()) - camera.cx) / camera.fx,
                              (static_cast<double>(keypoint.pixel.y()) - camera.cy) / camera.fy, 1.0);
    const Eigen::Vector3d turned = ExpSo3(turn_rate * dt) * ray;
    if (turned.z() > kInFront) keypoint.pixel = camera.ProjectUndistorted(turned).cast<float>();
  }
  features.grid = ImageGrid(features.keypoints);
  return features;
}

}  // namespace planar_vslam
