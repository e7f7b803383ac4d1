#pragma once
// What frames say of how well the robot knows its place, and of what has happened: for the topics `state` and `events`.
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/pipeline/frame_report.h"

namespace planar_vslam::ros_face {

// 0 without a pose, else 1 / (1 + (sigma / limit)^2) of the worse of position (0.1 m) and heading (0.1 rad): what
// navigation usually tolerates at a goal.
double Quality(const FrameReport& frame);

// "camera", "laser", "odometry" or "nothing". `min_inliers`: from which on the camera tells the pose.
std::string LocalisedBy(const FrameReport& frame, int min_inliers);

struct RobotEvent {
  std::string kind;  // as in msg/Event.msg
  std::string text;
};

// Compares each frame with the one before.
class EventFinder {
 public:
  // `loops`: closed in the map so far.
  std::vector<RobotEvent> OnFrame(const FrameReport& frame, std::size_t loops);
  void OnRestart() { *this = EventFinder(); }

 private:
  void FindJump(const FrameReport& frame, std::vector<RobotEvent>* events);

  std::optional<Rigid2> T_map_odom_;
  std::size_t loops_ = 0;
  bool slipping_ = false, lost_ = false;
};

}  // namespace planar_vslam::ros_face
