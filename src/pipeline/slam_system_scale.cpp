// What is known of the map as a whole: its scale, and how uncertain a pose in it is.
#include <cmath>

#include "planar_vslam/geometry/tangent_parts.h"
#include "planar_vslam/pipeline/slam_system.h"
#include "planar_vslam/planar/scale_recovery.h"

namespace planar_vslam {

// What the tracker, which takes the map for true, does not know: how uncertain the newest keyframe is in the map, and
// how well the mount tells the base, here and at the map's origin. All carried to the frame.
Matrix6d SlamSystem::CovarianceOfMapAt(const Rigid3& T_map_base) const {
  Matrix6d covariance = Matrix6d::Zero();
  const Keyframe* newest = map_->keyframes.Find(covariance_of_);
  if (!map_->metric) return covariance;
  const double position = options_.mount.position * options_.mount.position;
  const Eigen::Matrix3d mount =
      Eigen::Vector3d(position, position, options_.mount.angle * options_.mount.angle).asDiagonal();
  const Rigid2 T_map_frame = ProjectToPlane(T_map_base);
  const Eigen::Matrix3d from_origin = AdjointSe2(T_map_frame.Inverse());
  Eigen::Matrix3d planar = mount + from_origin * mount * from_origin.transpose();
  if (newest != nullptr) {
    const Eigen::Matrix3d from_newest = AdjointSe2(T_map_frame.Inverse() * ProjectToPlane(newest->T_map_base));
    planar += from_newest * keyframe_covariance_ * from_newest.transpose();
  }
  covariance(kPlanarRows, kPlanarRows) = planar;
  return covariance;
}

void SlamSystem::AssessMapScale() {
  report_.map_scale = AssessScale(*map_, options_.scale, options_.systematic);
  const std::optional<ScaleMeasurement>& fused = report_.map_scale.fused;
  const bool known = map_->metric && fused.has_value() && fused->sigma <= options_.scale.max_sigma;
  if (known && !report_.scale_known_after.has_value()) report_.scale_known_after = distance_;
}

// An unscaled map becomes metric once the sources of scale settle on one: keyframes and points scaled, the map levelled
// to the first base pose, global bundle adjustment. With `scale.keyframes` it is the paper's procedure: N keyframes,
// and scale from odometry between them.
void SlamSystem::TryScaleRecovery(Timestamp stamp) {
  if (map_->metric || map_->keyframes.size() < 3) return;
  const MapScale& now = report_.map_scale;
  const int wanted = options_.scale.keyframes;
  if (wanted > 0) {
    const int have = static_cast<int>(map_->keyframes.size());
    scale_missing_ = have < wanted ? std::to_string(wanted - have) + " more keyframes for the scale" : "";
    if (!now.track.has_value()) scale_missing_ = "scale: drive on, sideways or forwards";
  } else {
    scale_missing_ = scale_gate_.Missing(now, options_.scale);
  }
  if (!scale_missing_.empty()) return;
  ApplyScale(stamp, wanted > 0 ? std::log(now.track->scale) : now.fused->log_scale);
}

void SlamSystem::ApplyScale(Timestamp stamp, double log_scale) {
  const std::vector<LeverArmSample> samples = LinkedTrack(*map_);
  report_.scale = ScaleReport{RecoverScale(samples, ScaleMethod::kSteps, 0.0).value_or(0.0),
                              RecoverScale(samples, ScaleMethod::kCentroids, 0.0).value_or(0.0),
                              std::exp(log_scale),
                              {},
                              std::prev(map_->keyframes.end())->first,
                              stamp};
  for (const auto& [id, keyframe] : map_->keyframes) {
    report_.scale->unscaled_cameras.emplace_back(keyframe.stamp, keyframe.T_map_camera());
  }
  const double scale = report_.scale->applied;
  Map scaled = ScaledToMetric(*map_, scale);
  trajectory_.OnScaled(scaled, scale);
  MappingOutcome outcome = AdjustWholeMap(std::move(scaled), bundle_);
  map_ = std::make_shared<const Map>(std::move(outcome.map));
  tracker_.OnMapScaled(*map_, scale);
  AssessMapScale();
}

}  // namespace planar_vslam
