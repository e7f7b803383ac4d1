#pragma once
// Where the robot truly is at any time: the drive on the floor it leads over, with the places it is carried to.
#include "planar_vslam/sim/drive.h"
#include "planar_vslam/sim/floor.h"
#include "planar_vslam/sim/robot_spec.h"

namespace planar_vslam {

class RobotMotion {
 public:
  RobotMotion(Drive drive, Floor floor, std::vector<KidnapSpec> kidnaps);

  double duration() const { return duration_; }  // s
  const Drive& drive() const { return drive_; }
  Rigid3 At(double time) const { return At(time, time); }  // T_world_base
  // T_world_base at `time` had nobody carried the robot after `carried_until`.
  Rigid3 At(double time, double carried_until) const;
  bool Carried(double after, double until) const;  // within (after, until]

 private:
  Drive drive_;
  Floor floor_;
  std::vector<KidnapSpec> kidnaps_;
  double duration_;
};

}  // namespace planar_vslam
