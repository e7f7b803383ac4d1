#pragma once
// Where the camera is on the robot: what the joints report, and where play in them leaves it.
#include <vector>

#include "planar_vslam/sim/robot_spec.h"

namespace planar_vslam {

class Head {
 public:
  Head(const HeadSpec& spec, const CameraSpec& camera);

  Rigid3 ReportedCamera(double time) const;  // T_base_camera as the robot believes it
  Rigid3 TrueCamera(double time) const;      // T_base_camera

 private:
  Rigid3 CameraAt(const Eigen::Vector2d& pan_tilt) const;

  HeadSpec spec_;
  Rigid3 T_base_camera_;  // at rest
  // rad, pan and tilt at steps of time: of two periods, the second of which repeats; else up to the last pose, which
  // holds. None: as reported.
  std::vector<Eigen::Vector2d> true_;
};

// Pan and tilt in rad that the motion asks for, standing still at every pose.
Eigen::Vector2d WantedPanTilt(const HeadSpec& spec, double time);

}  // namespace planar_vslam
