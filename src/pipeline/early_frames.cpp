#include "planar_vslam/pipeline/early_frames.h"

#include <algorithm>
#include <utility>

namespace planar_vslam {

void EarlyFrames::Add(EarlyFrame frame) {
  // In one go when there are twice too many, so that a frame costs the same however long there is no pose.
  if (capacity_ > 0 && frames_.size() >= 2 * capacity_) {
    frames_.erase(frames_.begin(), frames_.end() - static_cast<std::ptrdiff_t>(capacity_));
  }
  frames_.push_back(std::move(frame));
}

std::vector<RecordedFrame> EarlyFrames::TakeForNewMap(const Map& map) {
  const auto& [first, first_keyframe] = *map.keyframes.begin();
  const auto& [second, second_keyframe] = *std::prev(map.keyframes.end());
  Rigid2 T_start_first, T_start_frame;
  for (const EarlyFrame& frame : frames_) {
    if (frame.step.has_value()) T_start_frame = T_start_frame * frame.step->T_i_j;
    if (frame.stamp == first_keyframe.stamp) T_start_first = T_start_frame;
  }
  T_start_frame = Rigid2();
  std::vector<RecordedFrame> placed;
  for (const EarlyFrame& frame : std::exchange(frames_, {})) {
    if (frame.step.has_value()) T_start_frame = T_start_frame * frame.step->T_i_j;
    const bool is_first = frame.stamp == first_keyframe.stamp, is_second = frame.stamp == second_keyframe.stamp;
    if (!map.metric && !is_first && !is_second) continue;
    const Rigid3 T_first_frame = is_first ? Rigid3() : Embed3(T_start_first.Inverse() * T_start_frame);
    placed.push_back({frame.stamp, is_second ? second : first, is_second ? Rigid3() : T_first_frame,
                      frame.T_base_camera, false, frame.moment});
  }
  return placed;
}

std::vector<RecordedFrame> EarlyFrames::TakeBefore(const RecordedFrame& recognised, bool metric) {
  const std::vector<EarlyFrame> frames = std::exchange(frames_, {});
  std::vector<RecordedFrame> placed;
  Rigid2 T_now_frame;
  for (std::size_t i = frames.size(); metric && i-- > 1 && frames[i].step.has_value();) {
    T_now_frame = T_now_frame * frames[i].step->T_i_j.Inverse();
    placed.push_back({frames[i - 1].stamp, recognised.reference, recognised.T_ref_base * Embed3(T_now_frame),
                      frames[i - 1].T_base_camera, false, frames[i - 1].moment});
  }
  std::reverse(placed.begin(), placed.end());
  return placed;
}

}  // namespace planar_vslam
