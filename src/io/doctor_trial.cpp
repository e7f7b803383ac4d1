#include "doctor_trial.h"

#include "camera_yaw.h"

namespace planar_vslam::io {
namespace {

Expected<Trial> Map(Recording& recording, const PipelineOptions& options, bool with_odometry,
                    const RunSettings& settings) {
  const RecordingInfo& info = recording.info();
  Trial trial;
  trial.estimator = std::make_unique<Estimator>(
      EstimatorSettings{options, info.camera, info.has_base_transform, with_odometry, Schedule::kInline});
  Expected<RunResult> result = RunSession(recording, *trial.estimator, settings);
  if (!result.ok()) return result.error();
  trial.result = std::move(*result);
  return trial;
}

}  // namespace

Expected<Trial> MapOnTrial(Recording& recording, const PipelineOptions& options, const RunSettings& settings) {
  const bool with_odometry = recording.info().has_odometry && options.odometry != OdometryUse::kOff;
  std::vector<OdometryReading> readings;
  OdometryContinuity continuity;
  RunSettings listening = settings;
  listening.on_odometry = [&readings, &continuity](const OdometryReading& as_recorded) {
    const std::optional<OdometryReading> reading = continuity.Push(as_recorded);
    if (reading.has_value() && (readings.empty() || readings.back().stamp < reading->stamp))
      readings.push_back(*reading);
  };
  Expected<Trial> trial = Map(recording, options, with_odometry, listening);
  if (trial.ok() && with_odometry && recording.info().has_base_transform) {
    trial->yaw = FindCameraYaw(*trial->estimator, readings);
  }
  return trial;
}

Expected<Trial> MapByImages(Recording& recording, PipelineOptions options, const RunSettings& settings) {
  options.odometry = OdometryUse::kOff;
  options.initializer.mode = InitializationMode::kVisual;
  options.planar.mode = PlanarMode::kOff;
  return Map(recording, options, false, settings);
}

}  // namespace planar_vslam::io
