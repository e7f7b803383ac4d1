#pragma once
// The robot's true motion: an optional sideways shuffle, then forward driving along the waypoints.
#include <utility>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/geometry/rigid2.h"
#include "planar_vslam/sim/world.h"

namespace planar_vslam {

class Drive {
 public:
  static constexpr double kStep = 0.005;  // s between the poses

  explicit Drive(std::vector<Rigid2> poses) : poses_(std::move(poses)) {}
  double duration() const { return kStep * static_cast<double>(poses_.size() - 1); }  // s
  // T_world_base at `time` seconds, constant twist within a step; rests at both ends.
  Rigid2 At(double time) const;

 private:
  std::vector<Rigid2> poses_;
};

// The same way from its end to its start, forward.
DriveSpec Reversed(const DriveSpec& drive);

// An error when the drive comes closer than the robot's radius to an object or a wall, or does not arrive.
Expected<Drive> PlanDrive(const World& world);

}  // namespace planar_vslam
