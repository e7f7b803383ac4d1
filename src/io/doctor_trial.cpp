#include "doctor_trial.h"

#include <algorithm>
#include <string>

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

// The yaw that the map's own adjustment finds with the mount free, less the one assumed.
std::optional<CalibratedValue> FindYaw(const Estimator& estimator, const std::vector<OdometryReading>& readings) {
  if (estimator.map() == nullptr || !estimator.map()->metric) return std::nullopt;
  const PipelineOptions& options = estimator.settings().options;
  CalibrationOptions calibration;
  calibration.camera_sway_sigma = options.mount.angle;
  const Expected<CalibrationResult> result =
      CalibrateMap(*estimator.map(), readings, options.calibration, estimator.model(), calibration);
  if (!result.ok()) return std::nullopt;
  constexpr Eigen::Index kYaw = 5;  // of the mount
  const auto yaw = std::find_if(result->values.begin(), result->values.end(),
                                [](const CalibratedValue& value) { return value.name == "camera_yaw"; });
  if (yaw == result->values.end() || !yaw->observed) return std::nullopt;
  CalibratedValue off = *yaw;
  off.value -= options.calibration.camera_mount[kYaw];
  return off;
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
    trial->yaw = FindYaw(*trial->estimator, readings);
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
