#pragma once
// Frames from before there is a pose: once there is one, odometry places them.
#include <cstddef>
#include <optional>
#include <vector>

#include "planar_vslam/map/map.h"
#include "planar_vslam/pipeline/trajectory_recorder.h"

namespace planar_vslam {

struct EarlyFrame {
  Timestamp stamp;
  Rigid3 T_base_camera;
  std::optional<PlanarMotion> step;  // since the frame before
  ImageMoment moment = {};
};

class EarlyFrames {
 public:
  // `capacity`: how many are remembered at most, the latest ones; 0: all.
  explicit EarlyFrames(std::size_t capacity) : capacity_(capacity) {}

  void Add(EarlyFrame frame);
  // The first two keyframes of a map were made of two of them: all of them hang on the first keyframe by odometry, or
  // the two alone where the map is not metric. Forgets them.
  std::vector<RecordedFrame> TakeForNewMap(const Map& map);
  // The last one was recognised, and `recognised` says where: those before hang on the same keyframe by odometry, as
  // far back as that reaches; none where the map is not metric. The last one is left out. Forgets them.
  std::vector<RecordedFrame> TakeBefore(const RecordedFrame& recognised, bool metric);

 private:
  std::size_t capacity_;
  std::vector<EarlyFrame> frames_;
};

}  // namespace planar_vslam
