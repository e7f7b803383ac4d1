#include "planar_vslam/sim/true_motion.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

constexpr auto kMost = static_cast<std::size_t>(DrivenMotion::kMemory / Drive::kStep) + 1;  // that are remembered

}  // namespace

PlannedMotion::PlannedMotion(Drive drive, Floor floor, std::vector<KidnapSpec> kidnaps)
    : drive_(std::move(drive)), floor_(std::move(floor)), kidnaps_(std::move(kidnaps)), duration_(drive_.duration()) {
  for (const KidnapSpec& kidnap : kidnaps_) {
    if (kidnap.at < duration_) duration_ = std::max(kidnap.at, duration_ - kidnap.skip);
  }
}

Rigid3 PlannedMotion::At(double time, double carried_until) const { return floor_.Stand(PlaceAt(time, carried_until)); }

Rigid2 PlannedMotion::PlaceAt(double time, double carried_until) const {
  double driven = time;
  for (const KidnapSpec& kidnap : kidnaps_) {
    if (kidnap.at <= carried_until) driven += kidnap.skip;
  }
  return drive_.At(driven);
}

bool PlannedMotion::Carried(double after, double until) const {
  return std::any_of(kidnaps_.begin(), kidnaps_.end(),
                     [&](const KidnapSpec& kidnap) { return kidnap.at > after && kidnap.at <= until; });
}

void DrivenMotion::Append(const Rigid2& T_world_base) {
  poses_.push_back(carried_.empty() ? T_world_base : carried_.back().T_world_uncarried.Inverse() * T_world_base);
  if (poses_.size() > kMost) poses_.pop_front();
  ++last_;
}

void DrivenMotion::AppendPeople(const std::vector<double>& times) {
  people_.push_back(times);
  if (people_.size() > kMost) people_.pop_front();
}

// By whole steps: nobody's own time jumps but where they turn back, where their place does not.
double DrivenMotion::PersonTime(std::size_t person, double time) const {
  if (people_.empty()) return time;
  const double back = std::max(0.0, (now() - time) / Drive::kStep);
  const auto steps = std::min(people_.size() - 1, static_cast<std::size_t>(std::lround(back)));
  return people_[people_.size() - 1 - steps].at(person);
}

void DrivenMotion::Carry(const Rigid2& T_world_base) {
  carried_.push_back({now(), T_world_base * poses_.back().Inverse()});
}

bool DrivenMotion::Carried(double after, double until) const {
  return std::any_of(carried_.begin(), carried_.end(),
                     [&](const Carrying& carrying) { return carrying.at > after && carrying.at <= until; });
}

Rigid3 DrivenMotion::At(double time, double carried_until) const {
  const auto newest = static_cast<double>(poses_.size() - 1);
  const double first = static_cast<double>(last_) - newest;
  const double position = std::clamp(time / Drive::kStep - first, 0.0, newest);
  const auto i = static_cast<std::size_t>(position);
  const double share = position - static_cast<double>(i);
  Rigid2 T = share == 0.0 ? poses_[i] : Interpolate(poses_[i], poses_[i + 1], share);
  const auto last = std::find_if(carried_.rbegin(), carried_.rend(),
                                 [&](const Carrying& carrying) { return carrying.at <= carried_until; });
  if (last != carried_.rend()) T = last->T_world_uncarried * T;
  return floor_.Stand(T);
}

}  // namespace planar_vslam
