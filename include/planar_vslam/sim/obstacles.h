#pragma once
// What the robot's body cannot go through: the room's walls, solid objects, people, and edges it would fall off.
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/sim/floor.h"
#include "planar_vslam/sim/solids.h"
#include "planar_vslam/sim/world.h"

namespace planar_vslam {

class Obstacles {
 public:
  // The robot's body is the upright cylinder of `radius` m around the base's axis.
  Obstacles(const World& world, double radius);

  // What the robot touches at `time` (s, of the people), as the world file calls it.
  std::optional<std::string> Touched(const Rigid2& T_world_base, double time) const;
  // From the robot's body to the nearest wall, object or person; negative: so far inside. Metres.
  double Clearance(const Eigen::Vector2d& at, double time) const;
  // People's own times, which count instead of `time` from now on.
  void SetPeopleTimes(const std::vector<double>& times) { people_times_ = times; }
  // More tilted than any ramp makes it.
  bool Falls(const Rigid2& T_world_base) const;

 private:
  struct Nearest {
    double clearance;  // m
    int solid;         // index in solids_, or one of the two below
  };
  // Around a solid's footprint: what is farther away needs no closer look.
  struct Circle {
    Eigen::Vector2d centre;  // m
    double radius;           // m
  };
  static constexpr int kWall = -1, kPerson = -2;
  Eigen::Vector2d PlaceOf(std::size_t person, double time) const;
  Nearest FindNearest(const Eigen::Vector2d& at, double time) const;
  std::string NameOf(const Nearest& nearest, const Eigen::Vector2d& at, double time) const;

  World world_;
  double radius_;
  std::vector<Prism> solids_;    // at the height of the body
  std::vector<Circle> circles_;  // one a solid
  Floor floor_;
  std::vector<double> people_times_;  // s; empty: everybody's time
};

}  // namespace planar_vslam
