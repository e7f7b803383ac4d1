#pragma once
// The pose of every frame relative to the keyframe before it and, once there is one, to the keyframe after it, so that
// the whole trajectory follows the keyframes when they move. Where the two then disagree, as they do after each
// adjustment, the frame moves with the nearer one more:
//   T_map_frame = A Exp(d_b / (d_b + d_a) Log(A^-1 B)),  A = T_map_before T_before_frame,  B = T_map_after
//   T_after_frame
// with d_b and d_a the ways to the keyframes: metres, and turns as those of a point half a metre away.
#include <cstddef>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "planar_vslam/backend/map_keyframe.h"
#include "planar_vslam/map/map.h"

namespace planar_vslam {

struct RecordedFrame {
  struct Next {
    KeyframeId keyframe;
    Rigid3 T_keyframe_base;
  };
  Timestamp stamp;
  KeyframeId reference;
  Rigid3 T_ref_base;
  Rigid3 T_base_camera;
  bool on_odometry = false;  // no view told its pose
  ImageMoment moment = {};
  std::optional<Next> next{};
};

class TrajectoryRecorder {
 public:
  // `capacity`: how many frames are remembered at least, the latest ones (twice as many at most); 0: all.
  explicit TrajectoryRecorder(std::size_t capacity = 0) : capacity_(capacity) {}

  void Add(const RecordedFrame& frame);
  // The last frame with this stamp became a keyframe: frames since the one before have it for their next. If it stood
  // on odometry alone, so did frames right before it, and they hang on it from now on: when the robot was kidnapped,
  // that was before them.
  void Reanchor(Timestamp stamp, KeyframeId keyframe);
  void OnCulled(const std::vector<CulledKeyframe>& culled);
  // The map was scaled: camera motion relative to the reference keyframes scales, extrinsics do not.
  void OnScaled(const Map& map, double scale);
  // Images turned out to be taken `offset` after their stamps; `map` as it was before it followed (SetImageOffset).
  // Frames on odometry alone go with their keyframes.
  void OnImageOffset(const Map& map, double offset);
  // How the mount of a keyframe shifts with that (image_moment.h), and that of the last frame.
  Rigid3 ShiftOf(const Map& map, KeyframeId id, double offset) const;
  Rigid3 ShiftOfLast(double offset) const;
  // T_map_base of every remembered frame in `map`.
  std::vector<std::pair<Timestamp, Rigid3>> Poses(const Map& map) const;
  // Frames are numbered from 0 as they are added. A keyframe of `map` and T_keyframe_base of the frame; nothing when it
  // is forgotten.
  std::optional<std::pair<KeyframeId, Rigid3>> Anchor(const Map& map, std::size_t number) const;
  bool Remembers(std::size_t number) const { return number >= forgotten_ && number < size(); }
  // Of a frame that is remembered.
  bool IsOnOdometry(std::size_t number) const;
  // How many were added, forgotten ones included.
  std::size_t size() const { return forgotten_ + frames_.size(); }

 private:
  using KeyframePoses = std::map<KeyframeId, Rigid3>;  // T_map_base of culled keyframes
  Rigid3 PoseOfKeyframe(const Map& map, KeyframeId id, KeyframePoses* culled) const;
  Rigid3 PoseOf(const Map& map, const RecordedFrame& frame, KeyframePoses* culled) const;
  Rigid3 CameraOf(const Map& map, KeyframeId id) const;  // T_base_camera
  void KeepNeeded(KeyframeId id, std::map<KeyframeId, CulledKeyframe>* needed) const;
  void ForgetOldest();

  std::size_t capacity_;
  std::size_t forgotten_ = 0;
  std::vector<RecordedFrame> frames_;
  std::map<KeyframeId, CulledKeyframe> culled_;
};

}  // namespace planar_vslam
