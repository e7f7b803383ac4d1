#pragma once
// The topics `state` and `events`.
#include <planar_vslam/State.h>
#include <ros/node_handle.h>

#include <mutex>
#include <optional>

#include "parameters.h"
#include "robot_state.h"
#include "tracking_loop.h"

namespace planar_vslam::ros_face {

class StatePublisher {
 public:
  StatePublisher(ros::NodeHandle* node, const NodeSettings& settings);

  // On the tracking thread.
  void OnFrame(const FrameReport& report, const TrackingLoop& loop);
  void OnInput(const TrackingLoop& loop);
  void OnRestart();

 private:
  void PublishWhileNoFrameComes();

  const NodeSettings settings_;
  ros::Publisher state_, events_;
  EventFinder finder_;            // of the tracking thread
  std::optional<Timestamp> fix_;  // of the tracking thread
  std::mutex mutex_;
  State message_;                 // as published last, kept up to date but for the time
  std::string missing_;           // what the oldest waiting image waits for
  ros::WallTime last_;            // frame
  double time_since_fix_ = -1.0;  // then
  ros::WallTimer timer_;          // last: stops before the rest goes
};

}  // namespace planar_vslam::ros_face
