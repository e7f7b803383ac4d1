#pragma once
// Mapping the beginning of a recording on trial, for the doctor.
#include <memory>
#include <optional>

#include "planar_vslam/io/run_session.h"

namespace planar_vslam::io {

struct Trial {
  std::unique_ptr<Estimator> estimator;
  RunResult result;
  std::optional<Deviation> yaw;  // of the camera: see FindCameraYaw
};

// As `run` would map it, and the camera's yaw by what `calibrate` does.
Expected<Trial> MapOnTrial(Recording& recording, const PipelineOptions& options, const RunSettings& settings);
// From the images alone, without wheels, floor and scale.
Expected<Trial> MapByImages(Recording& recording, PipelineOptions options, const RunSettings& settings);

}  // namespace planar_vslam::io
