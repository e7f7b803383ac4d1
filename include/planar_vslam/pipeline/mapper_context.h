#pragma once
// What the stages of mapping are told of sensors and options.
#include "planar_vslam/backend/map_keyframe.h"
#include "planar_vslam/pipeline/options.h"

namespace planar_vslam {

// `has_base`: where the camera is on the base is known; else nothing is known of a floor either.
MeasurementModel MeasurementModelOf(const PipelineOptions& options, const CameraModel& camera, bool has_base);

MapperContext MapperContextOf(const PipelineOptions& options, const MeasurementModel& model);

// Whether keyframes of both can be adjusted as those of one camera.
bool IsSameCamera(const CameraModel& a, const CameraModel& b);

}  // namespace planar_vslam
