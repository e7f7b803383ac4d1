#include "camera_yaw.h"

#include <algorithm>

#include "planar_vslam/optimize/calibration.h"

namespace planar_vslam::io {

std::optional<Deviation> FindCameraYaw(const Estimator& estimator, const std::vector<OdometryReading>& readings) {
  const std::shared_ptr<const Map> map = estimator.map();
  if (map == nullptr || !map->metric) return std::nullopt;
  const PipelineOptions& options = estimator.settings().options;
  CalibrationOptions calibration;
  calibration.camera_sway_sigma = options.mount.angle;
  const Expected<CalibrationResult> result =
      CalibrateMap(*map, readings, options.calibration, estimator.model(), calibration);
  if (!result.ok()) return std::nullopt;
  constexpr Eigen::Index kYaw = 5;  // of the mount
  const auto yaw = std::find_if(result->values.begin(), result->values.end(),
                                [](const CalibratedValue& value) { return value.name == "camera_yaw"; });
  if (yaw == result->values.end() || !yaw->observed) return std::nullopt;
  return Deviation{yaw->value - options.calibration.camera_mount[kYaw], yaw->sigma};
}

}  // namespace planar_vslam::io
