#include "planar_vslam/pipeline/input_corrector.h"

#include <cmath>

#include "planar_vslam/optimize/mounted_reprojection_factor.h"

namespace planar_vslam {

InputCorrector::InputCorrector(const SensorCorrection& correction)
    : calibrated_scale_(correction.odometry.scale),
      camera_mount_(correction.camera_mount),
      odometry_(correction.odometry) {}

CameraFrame InputCorrector::Correct(CameraFrame frame) const {
  if (!camera_mount_.isZero()) frame.T_base_camera = Mounted(camera_mount_, frame.T_base_camera);
  return frame;
}

OdometryReading InputCorrector::Correct(const OdometryReading& reading) { return odometry_.Correct(reading); }

void InputCorrector::Take(const WheelErrors& errors) {
  const double length = std::exp(errors.log_length), turn = std::exp(errors.log_turn);
  odometry_.SetScale(calibrated_scale_.cwiseProduct(Eigen::Vector3d(length, length, turn)));
}

LaserFrame InputCorrector::Correct(LaserFrame frame) const {
  frame.scan.stamp = Correct(frame.scan.stamp);
  return frame;
}

Timestamp InputCorrector::Correct(Timestamp stamp) const { return odometry_.Correct(stamp); }

}  // namespace planar_vslam
