#include "estimator_session.h"

namespace planar_vslam {

void Estimator::Session::Count(const FrameReport& frame, const std::optional<PlanarMotion>& step) {
  ++report.frames[frame.state];
  last_frame = frame.stamp;
  if (frame.T_map_base.has_value() && !report.initialized.has_value()) report.initialized = frame.stamp;
  report.odometry_rejected += frame.odometry_rejected ? 1 : 0;
  if (frame.odometry_rejected && !slipping) ++report.slips;
  slipping = frame.odometry_rejected;
  report.missed_readout = localization->MissedReadout();
  if (!step.has_value()) return;
  distance += step->distance;
  ++(step->modelled ? report.odometry_by_model : report.odometry_by_messages);
}

void Estimator::Session::Count(const MapChange& change, double max_scale_sigma) {
  report.keyframes_made += change.keyframe.has_value() ? 1 : 0;
  report.keyframes_culled += static_cast<long>(change.keyframes_culled.size());
  if (change.wheels.has_value()) report.wheels = *change.wheels;
  if (change.loop.has_value()) report.loops.push_back({change.loop->closed, change.loop->keyframe, last_frame});
  if (change.joined.has_value()) {
    report.joined = change.joined;
    report.joined->in_map = last_frame;
    joined = true;
  }
  if (change.scaled.has_value()) report.scale = change.scaled;
  report.adjustments += change.bundle_iterations > 0 ? 1 : 0;
  report.adjustment_iterations += change.bundle_iterations;
  if (!change.failure.empty()) ++report.failed_adjustments[change.failure];
  if (!change.scale.has_value()) return;
  report.map_scale = *change.scale;
  const std::optional<ScaleMeasurement>& fused = change.scale->fused;
  const bool is_known = change.map->metric && fused.has_value() && fused->sigma <= max_scale_sigma;
  if (is_known && !report.scale_known_after.has_value()) report.scale_known_after = distance;
}

}  // namespace planar_vslam
