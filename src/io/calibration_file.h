#pragma once
// calibration.yaml of a dataset folder: the camera, and where the sensors sit on the base.
#include <filesystem>
#include <optional>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/geometry/rigid3.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam::io {

struct LaserGeometry {
  double angle_min = 0.0;        // rad
  double angle_increment = 0.0;  // rad
  double range_min = 0.0;        // m
  double range_max = 0.0;        // m
  std::optional<long> beams;     // expected ranges a sweep
};

struct Calibration {
  CameraModel camera;
  std::optional<Rigid3> T_base_camera;
  std::optional<Rigid3> T_base_laser;
  std::optional<LaserGeometry> laser;
};

// Unknown keys are errors: a misspelt one must not be read as zero.
Expected<Calibration> ReadCalibration(const std::filesystem::path& path);

}  // namespace planar_vslam::io
