// What users and other nodes tell the tracking loop to do.
#include <fmt/format.h>

#include "converters.h"
#include "planar_vslam/io/message_values.h"
#include "tracking_loop.h"

namespace planar_vslam::ros_face {

Expected<Estimator*> TrackingLoop::RequireEstimator() {
  if (estimator_ == nullptr) {
    if (!camera_.has_value()) return Error{"the camera is not known yet; expected camera_info first"};
    StartEstimator();
  }
  return estimator_.get();
}

Expected<bool> TrackingLoop::LoadMap(const SavedMap& saved) {
  const Expected<Estimator*> estimator = RequireEstimator();
  if (!estimator.ok()) return estimator.error();
  const Expected<bool> loaded = (*estimator)->LoadMap(saved);
  if (!loaded.ok()) return loaded;
  refused_ = false;
  events_.on_restart();
  return true;
}

Expected<bool> TrackingLoop::SetMode(RunMode mode) {
  const Expected<Estimator*> estimator = RequireEstimator();
  if (!estimator.ok()) return estimator.error();
  return (*estimator)->SetMode(mode);
}

Expected<bool> TrackingLoop::StartAt(const geometry_msgs::PoseWithCovarianceStamped& pose) {
  const std::string frame = io::FrameName(pose.header.frame_id);
  if (frame != io::FrameName(settings_.map_frame)) {
    return Error{fmt::format("pose: in frame '{}'; expected '{}'", frame, settings_.map_frame)};
  }
  const Expected<PoseWithTangentCovariance> start = ToPoseWithTangentCovariance(pose.pose);
  if (!start.ok()) return start.error();
  const Expected<Estimator*> estimator = RequireEstimator();
  if (!estimator.ok()) return estimator.error();
  return (*estimator)->StartAt(start->T_map_base, start->covariance);
}

Expected<bool> TrackingLoop::AdjustMap() {
  const Expected<Estimator*> estimator = RequireEstimator();
  if (!estimator.ok()) return estimator.error();
  return (*estimator)->AdjustMap();
}

Expected<bool> TrackingLoop::FindPlaceAnew() {
  const Expected<Estimator*> estimator = RequireEstimator();
  if (!estimator.ok()) return estimator.error();
  if (mode() != RunMode::kLocalization) {
    return Error{"the map would grow by what cannot be placed; expected mode localization"};
  }
  ForgetInput();
  (*estimator)->Restart();  // in the map that it localises in
  return true;
}

void TrackingLoop::Pause(bool paused) { paused_ = paused; }

}  // namespace planar_vslam::ros_face
