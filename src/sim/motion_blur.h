#pragma once
#include "picture.h"
#include "planar_vslam/geometry/rigid3.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam::sim {

// Smears every pixel along the way its point makes on the sensor while the shutter is open for `time` seconds, as its
// distance and the camera's velocity (along its own axes, m/s and rad/s) have it.
void BlurByMotion(const CameraModel& model, const RayTable& rays, const Vector6d& velocity, double time, int threads,
                  Picture* picture);

}  // namespace planar_vslam::sim
