#pragma once
// Applies the calibration to measurements as they come in: wheels to scale, everything but images onto the camera's
// clock, the camera where it is mounted; and what a growing map has shown the wheels to read wrong.
#include "planar_vslam/optimize/calibration.h"
#include "planar_vslam/pipeline/wheel_errors.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

class InputCorrector {
 public:
  explicit InputCorrector(const SensorCorrection& correction);

  CameraFrame Correct(CameraFrame frame) const;
  OdometryReading Correct(const OdometryReading& reading);
  LaserFrame Correct(LaserFrame frame) const;
  void Take(const WheelErrors& errors);      // from the next reading on
  Timestamp Correct(Timestamp stamp) const;  // of odometry or laser

 private:
  Eigen::Vector3d calibrated_scale_;
  Vector6d camera_mount_;
  OdometryCorrector odometry_;
};

}  // namespace planar_vslam
