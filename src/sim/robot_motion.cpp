#include "planar_vslam/sim/robot_motion.h"

#include <algorithm>

namespace planar_vslam {

RobotMotion::RobotMotion(Drive drive, Floor floor, std::vector<KidnapSpec> kidnaps)
    : drive_(std::move(drive)), floor_(std::move(floor)), kidnaps_(std::move(kidnaps)), duration_(drive_.duration()) {
  for (const KidnapSpec& kidnap : kidnaps_) {
    if (kidnap.at < duration_) duration_ = std::max(kidnap.at, duration_ - kidnap.skip);
  }
}

Rigid3 RobotMotion::At(double time, double carried_until) const {
  double driven = time;
  for (const KidnapSpec& kidnap : kidnaps_) {
    if (kidnap.at <= carried_until) driven += kidnap.skip;
  }
  return floor_.Stand(drive_.At(driven));
}

bool RobotMotion::Carried(double after, double until) const {
  return std::any_of(kidnaps_.begin(), kidnaps_.end(),
                     [&](const KidnapSpec& kidnap) { return kidnap.at > after && kidnap.at <= until; });
}

}  // namespace planar_vslam
