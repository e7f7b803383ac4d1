#pragma once
// The camera's yaw on the base, by what `calibrate` does.
#include <optional>
#include <vector>

#include "planar_vslam/pipeline/estimator.h"
#include "planar_vslam/pipeline/wheel_check.h"

namespace planar_vslam::io {

// rad, what the map's own adjustment finds with the mount free, less what is assumed: positive where the camera looks
// further to the left. `readings` as they came in, without their jumps. Nothing where the drive does not show it.
std::optional<Deviation> FindCameraYaw(const Estimator& estimator, const std::vector<OdometryReading>& readings);

}  // namespace planar_vslam::io
