#pragma once
// Time-ordered buffers that interpolate between readings and never extrapolate.
#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

enum class PushResult { kAccepted, kNotMonotonic, kNotFinite };

class OdometryBuffer {
 public:
  // Refuses readings whose stamp is not later than the last one's, or whose pose is not finite.
  PushResult Push(const OdometryReading& reading);
  bool empty() const { return readings_.empty(); }
  Timestamp first_stamp() const { return readings_.front().stamp; }
  Timestamp last_stamp() const { return readings_.back().stamp; }
  // Whether `stamp` lies between the first and the last reading.
  bool Covers(Timestamp stamp) const;
  // T_odom_base at `stamp`, constant twist between neighbours; nothing outside the covered span.
  std::optional<Rigid2> Interpolate(Timestamp stamp) const;
  // The readings from `from` to `to`, both ends interpolated; empty when either end is not covered. Needs from <= to.
  std::vector<OdometryReading> Slice(Timestamp from, Timestamp to) const;
  // Forgets readings no query at or after `stamp` needs.
  void DropBefore(Timestamp stamp);

 private:
  std::deque<OdometryReading> readings_;
};

// A pose that changes with time (camera on a moving neck), or one that never does.
class TransformBuffer {
 public:
  void SetStatic(const Rigid3& T_parent_child);
  PushResult Push(Timestamp stamp, const Rigid3& T_parent_child);
  bool empty() const { return !static_.has_value() && samples_.empty(); }
  bool is_static() const { return static_.has_value(); }
  // Interpolated; before the first and after the last sample: nothing.
  std::optional<Rigid3> At(Timestamp stamp) const;
  bool Covers(Timestamp stamp) const;
  void DropBefore(Timestamp stamp);

 private:
  struct Sample {
    Timestamp stamp;
    Rigid3 T_parent_child;
  };
  std::optional<Rigid3> static_;
  std::deque<Sample> samples_;
};

}  // namespace planar_vslam
