#pragma once
#include <cmath>
#include <cstdint>

namespace planar_vslam {

// Nanoseconds since an epoch the recording defines. Integers, so that pairing by stamp is exact.
struct Timestamp {
  std::int64_t nanoseconds = 0;

  static Timestamp FromSeconds(double seconds) { return {std::llround(seconds * 1e9)}; }
  double Seconds() const { return static_cast<double>(nanoseconds) * 1e-9; }

  friend bool operator==(Timestamp a, Timestamp b) { return a.nanoseconds == b.nanoseconds; }
  friend bool operator!=(Timestamp a, Timestamp b) { return a.nanoseconds != b.nanoseconds; }
  friend bool operator<(Timestamp a, Timestamp b) { return a.nanoseconds < b.nanoseconds; }
  friend bool operator<=(Timestamp a, Timestamp b) { return a.nanoseconds <= b.nanoseconds; }
  friend bool operator>(Timestamp a, Timestamp b) { return a.nanoseconds > b.nanoseconds; }
  friend bool operator>=(Timestamp a, Timestamp b) { return a.nanoseconds >= b.nanoseconds; }
};

// later - earlier, in seconds (exact integer difference first).
inline double SecondsBetween(Timestamp earlier, Timestamp later) {
  return static_cast<double>(later.nanoseconds - earlier.nanoseconds) * 1e-9;
}

inline Timestamp Shifted(Timestamp stamp, double seconds) {
  return {stamp.nanoseconds + Timestamp::FromSeconds(seconds).nanoseconds};
}

}  // namespace planar_vslam
