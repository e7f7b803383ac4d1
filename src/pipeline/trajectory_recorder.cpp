#include "planar_vslam/pipeline/trajectory_recorder.h"

#include <algorithm>

#include "planar_vslam/geometry/check.h"
#include "planar_vslam/planar/scale_recovery.h"

namespace planar_vslam {
namespace {

struct Beside {
  Rigid3 T_map_neighbor, T_neighbor_this;

  Rigid3 T_map_this() const { return T_map_neighbor * T_neighbor_this; }
  double Way() const {
    constexpr double kLever = 0.5;  // m
    return T_neighbor_this.translation.norm() + kLever * LogSo3(T_neighbor_this.rotation).norm();
  }
};

Rigid3 Between(const Beside& before, const Beside& after) {
  const double way = before.Way() + after.Way();
  const Rigid3 T_map_this = before.T_map_this();
  if (way == 0.0) return T_map_this;
  return T_map_this * ExpSe3(before.Way() / way * LogSe3(T_map_this.Inverse() * after.T_map_this()));
}

}  // namespace

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
    KeepNeeded(frame.reference, &needed);
    if (frame.next.has_value()) KeepNeeded(frame.next->keyframe, &needed);
  }
  culled_ = std::move(needed);
}

void TrajectoryRecorder::KeepNeeded(KeyframeId id, std::map<KeyframeId, CulledKeyframe>* needed) const {
  const auto it = culled_.find(id);
  if (it == culled_.end() || !needed->insert(*it).second) return;
  KeepNeeded(it->second.before.id, needed);
  KeepNeeded(it->second.after.id, needed);
}

bool TrajectoryRecorder::IsOnOdometry(std::size_t number) const {
  PV_CHECK(Remembers(number), "frame " << number << " of " << forgotten_ << " to " << size());
  return frames_[number - forgotten_].on_odometry;
}

void TrajectoryRecorder::Reanchor(Timestamp stamp, KeyframeId keyframe) {
  const auto made = std::find_if(frames_.rbegin(), frames_.rend(), [stamp](const auto& f) { return f.stamp <= stamp; });
  if (made == frames_.rend() || made->stamp != stamp) return;
  const RecordedFrame before = *made;
  const Rigid3 T_keyframe_ref = before.T_ref_base.Inverse();
  made->reference = keyframe;
  made->T_ref_base = Rigid3();
  made->on_odometry = false;
  if (!before.on_odometry) {
    for (auto it = std::next(made); it != frames_.rend() && it->reference == before.reference; ++it) {
      it->next = RecordedFrame::Next{keyframe, T_keyframe_ref * it->T_ref_base};
    }
    return;
  }
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
  for (RecordedFrame& f : frames_) {
    f.T_ref_base = ScaleCameraMotion(f.T_ref_base, CameraOf(map, f.reference), f.T_base_camera, scale);
    if (!f.next.has_value()) continue;
    f.next->T_keyframe_base =
        ScaleCameraMotion(f.next->T_keyframe_base, CameraOf(map, f.next->keyframe), f.T_base_camera, scale);
  }
  for (auto& [id, c] : culled_) {
    for (CulledKeyframe::Neighbor* n : {&c.before, &c.after})
      n->T_neighbor_culled = ScaleCameraMotion(n->T_neighbor_culled, n->T_base_camera, c.T_base_camera, scale);
  }
}

void TrajectoryRecorder::OnImageOffset(const Map& map, double offset) {
  for (RecordedFrame& f : frames_) {
    if (f.on_odometry) continue;
    const Rigid3 shift = MountShift(f.moment, offset);
    f.T_ref_base = ShiftOf(map, f.reference, offset) * f.T_ref_base * shift.Inverse();
    if (f.next.has_value()) {
      f.next->T_keyframe_base = ShiftOf(map, f.next->keyframe, offset) * f.next->T_keyframe_base * shift.Inverse();
    }
    f.T_base_camera = shift * f.T_base_camera;
    f.moment.offset = offset;
  }
  std::map<KeyframeId, CulledKeyframe> shifted = culled_;
  for (auto& [id, c] : shifted) {
    const Rigid3 shift = MountShift(c.moment, offset);
    for (CulledKeyframe::Neighbor* n : {&c.before, &c.after}) {
      const Rigid3 neighbor_shift = ShiftOf(map, n->id, offset);
      n->T_neighbor_culled = neighbor_shift * n->T_neighbor_culled * shift.Inverse();
      n->T_base_camera = neighbor_shift * n->T_base_camera;
    }
    c.T_base_camera = shift * c.T_base_camera;
    c.moment.offset = offset;
  }
  culled_ = std::move(shifted);
}

Rigid3 TrajectoryRecorder::ShiftOf(const Map& map, KeyframeId id, double offset) const {
  if (const Keyframe* keyframe = map.keyframes.Find(id)) return MountShift(keyframe->moment, offset);
  const auto culled = culled_.find(id);
  return culled != culled_.end() ? MountShift(culled->second.moment, offset) : Rigid3();
}

Rigid3 TrajectoryRecorder::ShiftOfLast(double offset) const {
  return frames_.empty() || frames_.back().on_odometry ? Rigid3() : MountShift(frames_.back().moment, offset);
}

Rigid3 TrajectoryRecorder::CameraOf(const Map& map, KeyframeId id) const {
  const auto culled = culled_.find(id);
  return culled != culled_.end() ? culled->second.T_base_camera : map.keyframes.At(id).T_base_camera;
}

Rigid3 TrajectoryRecorder::PoseOfKeyframe(const Map& map, KeyframeId id, KeyframePoses* culled) const {
  if (const Keyframe* keyframe = map.keyframes.Find(id)) return keyframe->T_map_base;
  if (const auto known = culled->find(id); known != culled->end()) return known->second;
  const auto it = culled_.find(id);
  PV_CHECK(it != culled_.end(), "keyframe " << id.value << " is neither in the map nor known as culled");
  const auto& [before, after] = std::pair(it->second.before, it->second.after);
  const Rigid3 pose = Between({PoseOfKeyframe(map, before.id, culled), before.T_neighbor_culled},
                              {PoseOfKeyframe(map, after.id, culled), after.T_neighbor_culled});
  return culled->emplace(id, pose).first->second;
}

Rigid3 TrajectoryRecorder::PoseOf(const Map& map, const RecordedFrame& frame, KeyframePoses* culled) const {
  const Beside before{PoseOfKeyframe(map, frame.reference, culled), frame.T_ref_base};
  if (!frame.next.has_value()) return before.T_map_this();
  return Between(before, {PoseOfKeyframe(map, frame.next->keyframe, culled), frame.next->T_keyframe_base});
}

std::optional<std::pair<KeyframeId, Rigid3>> TrajectoryRecorder::Anchor(const Map& map, std::size_t number) const {
  if (number < forgotten_) return std::nullopt;
  const RecordedFrame& frame = frames_.at(number - forgotten_);
  KeyframeId anchor = frame.reference;
  while (!map.keyframes.Contains(anchor)) anchor = culled_.at(anchor).before.id;
  KeyframePoses culled;
  return std::pair(anchor, map.keyframes.At(anchor).T_map_base.Inverse() * PoseOf(map, frame, &culled));
}

std::vector<std::pair<Timestamp, Rigid3>> TrajectoryRecorder::Poses(const Map& map) const {
  std::vector<std::pair<Timestamp, Rigid3>> poses;
  poses.reserve(frames_.size());
  KeyframePoses culled;
  for (const RecordedFrame& frame : frames_) poses.emplace_back(frame.stamp, PoseOf(map, frame, &culled));
  return poses;
}

}  // namespace planar_vslam
