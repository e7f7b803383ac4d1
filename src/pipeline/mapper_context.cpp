#include "planar_vslam/pipeline/mapper_context.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {

MeasurementModel MeasurementModelOf(const PipelineOptions& options, const CameraModel& camera, bool has_base) {
  MeasurementModel model{camera,         options.odometry_noise, options.planar,
                         options.bundle, options.pixel_sigma,    options.scan_match.floor};
  if (!has_base) model.planar.mode = PlanarMode::kOff;
  return model;
}

MapperContext MapperContextOf(const PipelineOptions& options, const MeasurementModel& model) {
  return {model, options.mapper, options.scan_match, options.systematic, options.loop};
}

bool IsSameCamera(const CameraModel& a, const CameraModel& b) {
  constexpr double kSame = 0.5;  // px
  const double difference =
      std::max({std::abs(a.fx - b.fx), std::abs(a.fy - b.fy), std::abs(a.cx - b.cx), std::abs(a.cy - b.cy)});
  return a.width == b.width && a.height == b.height && difference <= kSame;
}

}  // namespace planar_vslam
