#pragma once
#include <vector>

#include "planar_vslam/map/map.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam {

// Where a landmark should appear, if it should.
struct PredictedView {
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
  int octave = 0;
  double cos_view_angle = 1.0;  // between the ray and the mean viewing direction
};
bool PredictView(const Landmark& landmark, const Rigid3& T_map_camera, const CameraModel& camera,
                 const std::vector<double>& octave_scales, PredictedView* view);

}  // namespace planar_vslam
