#pragma once
// The pose of every frame relative to a keyframe, so that the whole trajectory follows the keyframes when they move.
#include <map>
#include <utility>
#include <vector>

#include "planar_vslam/backend/map_keyframe.h"
#include "planar_vslam/map/map.h"

namespace planar_vslam {

struct RecordedFrame {
  Timestamp stamp;
  KeyframeId reference;
  Rigid3 T_ref_base;
  Rigid3 T_base_camera;
  bool on_odometry = false;  // no view told its pose
};

class TrajectoryRecorder {
 public:
  void Add(const RecordedFrame& frame) { frames_.push_back(frame); }
  // The last frame with this stamp became a keyframe. If it stood on odometry alone, so did frames right before it, and
  // they hang on it from now on: when the robot was kidnapped, that was before them.
  void Reanchor(Timestamp stamp, KeyframeId keyframe);
  void OnCulled(const std::vector<CulledKeyframe>& culled);
  // The map was scaled: camera motion relative to the reference keyframes scales, extrinsics do not.
  void OnScaled(const Map& map, double scale);
  // T_map_base of every frame in `map`.
  std::vector<std::pair<Timestamp, Rigid3>> Poses(const Map& map) const;
  // A keyframe of `map` and T_keyframe_base of the frame with this index.
  std::pair<KeyframeId, Rigid3> Anchor(const Map& map, std::size_t frame) const;
  bool IsOnOdometry(std::size_t frame) const { return frames_[frame].on_odometry; }
  std::size_t size() const { return frames_.size(); }

 private:
  std::vector<RecordedFrame> frames_;
  std::map<KeyframeId, CulledKeyframe> culled_;
};

}  // namespace planar_vslam
