#include "planar_vslam/pipeline/trajectory_recorder.h"

#include <algorithm>

#include "planar_vslam/geometry/check.h"
#include "planar_vslam/planar/scale_recovery.h"

namespace planar_vslam {

void TrajectoryRecorder::Add(const RecordedFrame& frame) {
  if (capacity_ > 0 && frames_.size() >= 2 * capacity_) ForgetOldest();
  frames_.push_back(frame);
}

// Half of the frames, and the culled keyframes that none of the others hangs on.
void TrajectoryRecorder::ForgetOldest() {
  forgotten_ += frames_.size() - capacity_;
  frames_.erase(frames_.begin(), frames_.end() - static_cast<std::ptrdiff_t>(capacity_));
  std::map<KeyframeId, CulledKeyframe> needed;
  for (const RecordedFrame& frame : frames_) {
    for (auto it = culled_.find(frame.reference); it != culled_.end(); it = culled_.find(it->second.anchor)) {
      if (!needed.insert(*it).second) break;
    }
  }
  culled_ = std::move(needed);
}

bool TrajectoryRecorder::IsOnOdometry(std::size_t number) const {
  PV_CHECK(Remembers(number), "frame " << number << " of " << forgotten_ << " to " << size());
  return frames_[number - forgotten_].on_odometry;
}

void TrajectoryRecorder::Reanchor(Timestamp stamp, KeyframeId keyframe) {
  const auto made = std::find_if(frames_.rbegin(), frames_.rend(), [stamp](const auto& f) { return f.stamp <= stamp; });
  if (made == frames_.rend() || made->stamp != stamp) return;
  const RecordedFrame before = *made;
  made->reference = keyframe;
  made->T_ref_base = Rigid3();
  made->on_odometry = false;
  if (!before.on_odometry) return;
  const Rigid3 T_keyframe_ref = before.T_ref_base.Inverse();
  for (auto it = std::next(made); it != frames_.rend(); ++it) {
    if (!it->on_odometry || it->reference != before.reference) break;
    it->reference = keyframe;
    it->T_ref_base = T_keyframe_ref * it->T_ref_base;
    it->on_odometry = false;
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

std::optional<std::pair<KeyframeId, Rigid3>> TrajectoryRecorder::Anchor(const Map& map, std::size_t number) const {
  if (number < forgotten_) return std::nullopt;
  return AnchorOf(map, frames_.at(number - forgotten_));
}

std::pair<KeyframeId, Rigid3> TrajectoryRecorder::AnchorOf(const Map& map, const RecordedFrame& frame) const {
  KeyframeId reference = frame.reference;
  Rigid3 T_reference_base = frame.T_ref_base;
  for (auto it = culled_.find(reference); it != culled_.end(); it = culled_.find(reference)) {
    T_reference_base = it->second.T_anchor_culled * T_reference_base;
    reference = it->second.anchor;
  }
  PV_CHECK(map.keyframes.Contains(reference),
           "frame at " << frame.stamp.nanoseconds << " ns, keyframe " << reference.value);
  return {reference, T_reference_base};
}

std::vector<std::pair<Timestamp, Rigid3>> TrajectoryRecorder::Poses(const Map& map) const {
  std::vector<std::pair<Timestamp, Rigid3>> poses;
  poses.reserve(frames_.size());
  for (const RecordedFrame& frame : frames_) {
    const auto [keyframe, T_keyframe_base] = AnchorOf(map, frame);
    poses.emplace_back(frame.stamp, map.keyframes.At(keyframe).T_map_base * T_keyframe_base);
  }
  return poses;
}

}  // namespace planar_vslam
