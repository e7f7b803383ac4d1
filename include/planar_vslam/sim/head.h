#pragma once
// Where the camera is on the robot: what the joints report, and where play in them leaves it.
#include <vector>

#include "planar_vslam/sim/robot_spec.h"

namespace planar_vslam {

class Head {
 public:
  // Moves for `duration` seconds, then rests.
  Head(const HeadSpec& spec, const CameraSpec& camera, double duration);

  Rigid3 ReportedCamera(double time) const;  // T_base_camera as the robot believes it
  Rigid3 TrueCamera(double time) const;      // T_base_camera

 private:
  Rigid3 CameraAt(const Eigen::Vector2d& pan_tilt) const;

  HeadSpec spec_;
  Rigid3 T_base_camera_;               // at rest
  std::vector<Eigen::Vector2d> true_;  // rad, pan and tilt at steps of time; none: as reported
};

// Pan and tilt in rad that the motion asks for, standing still at every pose.
Eigen::Vector2d WantedPanTilt(const HeadSpec& spec, double time);

}  // namespace planar_vslam
