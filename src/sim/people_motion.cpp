#include "planar_vslam/sim/people_motion.h"

#include <cmath>

namespace planar_vslam {
namespace {

constexpr double kBody = 0.25;     // m, as Obstacles has it
constexpr double kDistance = 0.5;  // m between the bodies
constexpr double kPatience = 3.0;  // s, until they turn back

// When somebody is at the same place on the way back.
double TurnedBack(const PersonSpec& person, double time) {
  double length = 0.0;
  for (std::size_t i = 1; i < person.path.size(); ++i) length += (person.path[i] - person.path[i - 1]).norm();
  const double turn = std::fmod(person.start + person.speed * time, 2.0 * length);
  return time + 2.0 * (turn < length ? length - turn : 2.0 * length - turn) / person.speed;
}

}  // namespace

PeopleMotion::PeopleMotion(std::vector<PersonSpec> people, double robot_radius)
    : people_(std::move(people)), robot_radius_(robot_radius), times_(people_.size(), 0.0), waited_(people_.size()) {}

// Ahead, within half a circle of the distance kept.
bool PeopleMotion::Sees(const Walker& walker, const Eigen::Vector2d& robot) const {
  const Eigen::Vector2d p_walker = walker.T_world_walker.Inverse() * robot;
  return p_walker.x() > 0.0 && p_walker.norm() < robot_radius_ + kBody + kDistance;
}

void PeopleMotion::Step(const Eigen::Vector2d& robot, double seconds) {
  for (std::size_t i = 0; i < people_.size(); ++i) {
    if (people_[i].speed <= 0.0 || !Sees(WalkerAt(people_[i], times_[i]), robot)) {
      times_[i] += seconds;
      waited_[i] = 0.0;
      continue;
    }
    waited_[i] += seconds;
    if (waited_[i] < kPatience) continue;
    times_[i] = TurnedBack(people_[i], times_[i]);
    waited_[i] = 0.0;
  }
}

}  // namespace planar_vslam
