#pragma once
// The topic `debug_image`: what tracking saw in a frame. Drawn off the tracking thread, and only while somebody looks.
#include <image_transport/image_transport.h>

#include <atomic>

#include "parameters.h"
#include "planar_vslam/pipeline/executor.h"
#include "tracking_loop.h"

namespace planar_vslam::ros_face {

class DebugImagePublisher {
 public:
  DebugImagePublisher(const ros::NodeHandle& node, const NodeSettings& settings);

  // On the tracking thread, with the last frame. One that comes while the one before is being drawn is left out.
  void OnFrame(const FrameReport& report, const TrackingLoop& loop);

 private:
  static constexpr int kNiceness = 10;  // tracking and mapping go first

  const int min_inliers_;
  image_transport::Publisher publisher_;
  std::atomic<bool> drawing_{false};
  WorkerExecutor worker_{kNiceness};  // last: its jobs end before the rest goes
};

}  // namespace planar_vslam::ros_face
