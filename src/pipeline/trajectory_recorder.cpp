#include "planar_vslam/pipeline/trajectory_recorder.h"

#include "planar_vslam/planar/scale_recovery.h"

namespace planar_vslam {

void TrajectoryRecorder::Reanchor(Timestamp stamp, KeyframeId keyframe) {
  for (auto it = frames_.rbegin(); it != frames_.rend() && it->stamp >= stamp; ++it) {
    if (it->stamp != stamp) continue;
    it->reference = keyframe;
    it->T_ref_base = Rigid3();
  }
}

void TrajectoryRecorder::OnCulled(const std::vector<CulledKeyframe>& culled) {
  for (const CulledKeyframe& c : culled) culled_[c.id] = c;
}

void TrajectoryRecorder::OnScaled(const Map& map, double scale) {
  for (RecordedFrame& frame : frames_) {
    const auto culled = culled_.find(frame.reference);
    const Rigid3 T_ref_camera =
        culled != culled_.end() ? culled->second.T_culled_camera : map.keyframes.At(frame.reference).T_base_camera;
    frame.T_ref_base = ScaleCameraMotion(frame.T_ref_base, T_ref_camera, frame.T_base_camera, scale);
  }
  for (auto& [id, c] : culled_) {
    c.T_anchor_culled = ScaleCameraMotion(c.T_anchor_culled, c.T_anchor_camera, c.T_culled_camera, scale);
  }
}

Rigid3 TrajectoryRecorder::Resolve(const Map& map, KeyframeId reference) const {
  Rigid3 T_anchor_ref;
  for (auto it = culled_.find(reference); it != culled_.end(); it = culled_.find(reference)) {
    T_anchor_ref = it->second.T_anchor_culled * T_anchor_ref;
    reference = it->second.anchor;
  }
  return map.keyframes.At(reference).T_map_base * T_anchor_ref;
}

std::vector<std::pair<Timestamp, Rigid3>> TrajectoryRecorder::Poses(const Map& map) const {
  std::vector<std::pair<Timestamp, Rigid3>> poses;
  poses.reserve(frames_.size());
  for (const RecordedFrame& frame : frames_) {
    poses.emplace_back(frame.stamp, Resolve(map, frame.reference) * frame.T_ref_base);
  }
  return poses;
}

}  // namespace planar_vslam
