#pragma once
// When the wheels slip, and how much.
#include <cstdint>
#include <random>
#include <vector>

#include "planar_vslam/sim/robot_spec.h"

namespace planar_vslam {

// Slips at random times, one after the other, for ever.
class RandomSlips {
 public:
  RandomSlips(const RandomSlipSpec& spec, std::uint64_t seed);
  bool any() const { return spec_.rate > 0.0; }
  SlipSpec Next();  // later than the one before; needs any()

 private:
  RandomSlipSpec spec_;
  std::mt19937_64 generator_;
  double clock_ = 0.0;  // s, end of the last slip
};

// The random slips that begin within `duration` seconds, in the order of time.
std::vector<SlipSpec> DrawSlips(const RandomSlipSpec& spec, double duration, std::uint64_t seed);

// The given slips and the random ones.
class SlipSchedule {
 public:
  SlipSchedule(const EventsSpec& events, std::uint64_t seed);
  // The factor between what wheels and robot do, averaged over the time. Times never go back.
  double Factor(double from, double to);

 private:
  std::vector<SlipSpec> slips_;  // given, and random ones up to the first that is still to come
  RandomSlips random_;
  double drawn_ = 0.0;  // s, beginning of the last random slip drawn
};

}  // namespace planar_vslam
