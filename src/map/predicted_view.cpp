#include "planar_vslam/map/predicted_view.h"

namespace planar_vslam {
namespace {

constexpr double kMinCosViewAngle = 0.5;  // 60 degrees from the mean viewing direction
constexpr double kDistanceSlack = 1.25;   // of the scale-invariance distances

// The first octave whose scale makes up for how much nearer the landmark is than max_distance, where octave 0 shows it.
int PredictOctave(const Landmark& landmark, double distance, const std::vector<double>& scales) {
  constexpr double kRounding = 1.0 + 1e-10;  // a landmark at exactly the distance of an octave belongs to it
  const double ratio = landmark.max_distance / distance;
  int octave = 0;
  for (const int last = static_cast<int>(scales.size()) - 1; octave < last; ++octave) {
    if (ratio <= scales[static_cast<std::size_t>(octave)] * kRounding) break;
  }
  return octave;
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
