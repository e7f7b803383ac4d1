#include "planar_vslam/sim/true_motion.h"

#include <algorithm>

namespace planar_vslam {

PlannedMotion::PlannedMotion(Drive drive, Floor floor, std::vector<KidnapSpec> kidnaps)
    : drive_(std::move(drive)), floor_(std::move(floor)), kidnaps_(std::move(kidnaps)), duration_(drive_.duration()) {
  for (const KidnapSpec& kidnap : kidnaps_) {
    if (kidnap.at < duration_) duration_ = std::max(kidnap.at, duration_ - kidnap.skip);
  }
}

Rigid3 PlannedMotion::At(double time, double carried_until) const {
  double driven = time;
  for (const KidnapSpec& kidnap : kidnaps_) {
    if (kidnap.at <= carried_until) driven += kidnap.skip;
  }
  return floor_.Stand(drive_.At(driven));
}

bool PlannedMotion::Carried(double after, double until) const {
  return std::any_of(kidnaps_.begin(), kidnaps_.end(),
                     [&](const KidnapSpec& kidnap) { return kidnap.at > after && kidnap.at <= until; });
}

void DrivenMotion::Append(const Rigid2& T_world_base) {
  constexpr auto kMost = static_cast<std::size_t>(kMemory / Drive::kStep) + 1;
  poses_.push_back(T_world_base);
  if (poses_.size() > kMost) poses_.pop_front();
  ++last_;
}

Rigid3 DrivenMotion::At(double time, double /*carried_until*/) const {
  const auto newest = static_cast<double>(poses_.size() - 1);
  const double first = static_cast<double>(last_) - newest;
  const double position = std::clamp(time / Drive::kStep - first, 0.0, newest);
  const auto i = static_cast<std::size_t>(position);
  const double share = position - static_cast<double>(i);
  if (share == 0.0) return floor_.Stand(poses_[i]);
  return floor_.Stand(Interpolate(poses_[i], poses_[i + 1], share));
}

}  // namespace planar_vslam
