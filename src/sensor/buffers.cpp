#include "planar_vslam/sensor/buffers.h"

#include <algorithm>
#include <cmath>

#include "planar_vslam/geometry/check.h"

namespace planar_vslam {

namespace {

constexpr double kFarthest = 1e7;  // m: a larger reading is corrupt, and its square would leave a covariance no digits

bool IsFinite(const Rigid2& T) {
  return T.translation.allFinite() && T.translation.cwiseAbs().maxCoeff() < kFarthest && std::isfinite(T.angle);
}
bool IsFinite(const Rigid3& T) { return T.translation.allFinite() && std::isfinite(T.rotation.norm()); }

double Fraction(Timestamp before, Timestamp stamp, Timestamp after) {
  return SecondsBetween(before, stamp) / SecondsBetween(before, after);
}

// First entry not before `stamp`.
template <class Entries>
auto NotBefore(const Entries& entries, Timestamp stamp) {
  return std::lower_bound(entries.begin(), entries.end(), stamp,
                          [](const auto& entry, Timestamp value) { return entry.stamp < value; });
}

template <class Entries>
bool Spans(const Entries& entries, Timestamp stamp) {
  return !entries.empty() && entries.front().stamp <= stamp && stamp <= entries.back().stamp;
}

// Keeps the last entry at or before `stamp`: it is one end of the interval that holds `stamp`.
template <class Entries>
void DropEntriesBefore(Entries* entries, Timestamp stamp) {
  while (entries->size() >= 2 && (*entries)[1].stamp <= stamp) entries->pop_front();
}

}  // namespace

PushResult OdometryBuffer::Push(const OdometryReading& reading) {
  if (!IsFinite(reading.T_odom_base)) return PushResult::kNotFinite;
  if (!readings_.empty() && reading.stamp <= readings_.back().stamp) return PushResult::kNotMonotonic;
  readings_.push_back(reading);
  return PushResult::kAccepted;
}

bool OdometryBuffer::Covers(Timestamp stamp) const { return Spans(readings_, stamp); }

std::optional<Rigid2> OdometryBuffer::Interpolate(Timestamp stamp) const {
  if (!Covers(stamp)) return std::nullopt;
  const auto after = NotBefore(readings_, stamp);
  if (after->stamp == stamp) return after->T_odom_base;
  const auto before = std::prev(after);
  return planar_vslam::Interpolate(before->T_odom_base, after->T_odom_base,
                                   Fraction(before->stamp, stamp, after->stamp));
}

std::vector<OdometryReading> OdometryBuffer::Slice(Timestamp from, Timestamp to) const {
  PV_CHECK(from <= to, "from=" << from.nanoseconds << " to=" << to.nanoseconds);
  if (!Covers(from) || !Covers(to)) return {};
  std::vector<OdometryReading> slice;
  slice.push_back({from, *Interpolate(from)});
  if (from == to) return slice;
  for (auto it = NotBefore(readings_, from); it->stamp < to; ++it) {
    if (it->stamp > from) slice.push_back(*it);
  }
  slice.push_back({to, *Interpolate(to), NotBefore(readings_, to)->covariance_rate});
  return slice;
}

void OdometryBuffer::DropBefore(Timestamp stamp) { DropEntriesBefore(&readings_, stamp); }

void TransformBuffer::SetStatic(const Rigid3& T_parent_child) {
  static_ = T_parent_child;
  samples_.clear();
}

PushResult TransformBuffer::Push(Timestamp stamp, const Rigid3& T_parent_child) {
  PV_CHECK(!is_static(), "a sample at " << stamp.nanoseconds << " ns for a transform set static");
  if (!IsFinite(T_parent_child) || T_parent_child.rotation.norm() == 0.0) return PushResult::kNotFinite;
  if (!samples_.empty() && stamp <= samples_.back().stamp) return PushResult::kNotMonotonic;
  samples_.push_back({stamp, Rigid3(T_parent_child.rotation.normalized(), T_parent_child.translation)});
  return PushResult::kAccepted;
}

std::optional<Rigid3> TransformBuffer::At(Timestamp stamp) const {
  if (is_static()) return static_;
  if (!Covers(stamp)) return std::nullopt;
  const auto after = NotBefore(samples_, stamp);
  if (after->stamp == stamp) return after->T_parent_child;
  const auto before = std::prev(after);
  return Interpolate(before->T_parent_child, after->T_parent_child, Fraction(before->stamp, stamp, after->stamp));
}

bool TransformBuffer::Covers(Timestamp stamp) const { return is_static() || Spans(samples_, stamp); }

void TransformBuffer::DropBefore(Timestamp stamp) { DropEntriesBefore(&samples_, stamp); }

}  // namespace planar_vslam
