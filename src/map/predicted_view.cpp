#include "planar_vslam/map/predicted_view.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

constexpr double kMinCosViewAngle = 0.5;  // 60 degrees from the mean viewing direction
constexpr double kDistanceSlack = 1.25;   // of the scale-invariance distances

int PredictOctave(const Landmark& landmark, double distance, const std::vector<double>& scales) {
  const double log_ratio = std::log(landmark.max_distance / distance) / std::log(scales.size() > 1 ? scales[1] : 2.0);
  const int octave = static_cast<int>(std::ceil(log_ratio - 1e-9));
  return std::clamp(octave, 0, static_cast<int>(scales.size()) - 1);
}

}  // namespace

bool PredictView(const Landmark& landmark, const Rigid3& T_map_camera, const CameraModel& camera,
                 const std::vector<double>& octave_scales, PredictedView* view) {
  const Eigen::Vector3d from_camera = landmark.p_map - T_map_camera.translation;
  const Eigen::Vector3d p_camera = T_map_camera.rotation.conjugate() * from_camera;
  if (p_camera.z() <= 0.0) return false;
  const Eigen::Vector2d pixel = camera.ProjectUndistorted(p_camera);
  if (pixel.x() < 0.0 || pixel.y() < 0.0 || pixel.x() >= camera.width || pixel.y() >= camera.height) return false;
  const double distance = from_camera.norm();
  if (distance > kDistanceSlack * landmark.max_distance || distance < landmark.min_distance / kDistanceSlack)
    return false;
  view->cos_view_angle = from_camera.dot(landmark.view_direction) / distance;
  if (view->cos_view_angle < kMinCosViewAngle) return false;
  view->pixel = pixel.cast<float>();
  view->octave = PredictOctave(landmark, distance, octave_scales);
  return true;
}

}  // namespace planar_vslam
