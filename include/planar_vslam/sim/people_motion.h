#pragma once
// People who see the robot: they stop in front of it, at the distance that strangers keep (Hall, 1966: personal space
// begins at 0.45 m), and turn back when it does not go away. Their ways and speeds are those of the world's people;
// what they do differently is told by a clock of their own, which WalkerAt takes.
#include <Eigen/Core>
#include <vector>

#include "planar_vslam/sim/scene.h"

namespace planar_vslam {

class PeopleMotion {
 public:
  // `robot_radius` in m.
  PeopleMotion(std::vector<PersonSpec> people, double robot_radius);

  // `seconds` later, the robot's axis at `robot` (m).
  void Step(const Eigen::Vector2d& robot, double seconds);
  // Each person's own time, s.
  const std::vector<double>& times() const { return times_; }

 private:
  bool Sees(const Walker& walker, const Eigen::Vector2d& robot) const;

  std::vector<PersonSpec> people_;
  double robot_radius_;
  std::vector<double> times_, waited_;  // s
};

}  // namespace planar_vslam
