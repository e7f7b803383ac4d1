#include "planar_vslam/sim/slips.h"

#include <algorithm>

#include "planar_vslam/geometry/check.h"
#include "planar_vslam/sim/random.h"

namespace planar_vslam {

RandomSlips::RandomSlips(const RandomSlipSpec& spec, std::uint64_t seed)
    : spec_(spec), generator_(MixSeed(seed, RandomStream::kSlips)) {}

SlipSpec RandomSlips::Next() {
  PV_CHECK(any(), spec_.rate << " slips per minute");
  std::exponential_distribution<double> pause(spec_.rate / 60.0);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  const auto within = [&](const Eigen::Vector2d& range) {
    return range[0] + share(generator_) * (range[1] - range[0]);
  };
  SlipSpec slip;
  slip.at = clock_ + pause(generator_);
  slip.duration = within(spec_.duration);
  const bool spins = share(generator_) < 0.5;
  slip.factor = within(spins ? spec_.spinning : spec_.skidding);
  clock_ = slip.at + slip.duration;
  return slip;
}

std::vector<SlipSpec> DrawSlips(const RandomSlipSpec& spec, double duration, std::uint64_t seed) {
  std::vector<SlipSpec> slips;
  RandomSlips random(spec, seed);
  if (!random.any()) return slips;
  for (SlipSpec slip = random.Next(); slip.at < duration; slip = random.Next()) slips.push_back(slip);
  return slips;
}

SlipSchedule::SlipSchedule(const EventsSpec& events, std::uint64_t seed)
    : slips_(events.slips), random_(events.random_slips, seed) {}

double SlipSchedule::Factor(double from, double to) {
  while (random_.any() && drawn_ <= to) {
    slips_.push_back(random_.Next());
    drawn_ = slips_.back().at;
  }
  const auto over = [from](const SlipSpec& slip) { return slip.at + slip.duration < from; };
  slips_.erase(std::remove_if(slips_.begin(), slips_.end(), over), slips_.end());
  double factor = 1.0;
  for (const SlipSpec& slip : slips_) {
    const double during = std::min(to, slip.at + slip.duration) - std::max(from, slip.at);
    if (during > 0.0) factor += (slip.factor - 1.0) * during / (to - from);
  }
  return std::max(factor, 0.0);
}

}  // namespace planar_vslam
