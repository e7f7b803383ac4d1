#include "planar_vslam/pipeline/stage_statistics.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam {
namespace {

constexpr double kShortest = 1e-3;  // ms
const double kLogWidth = std::log(1.05);

}  // namespace

void DurationHistogram::Add(double milliseconds) {
  const double bucket = std::floor(std::log(std::max(milliseconds, kShortest) / kShortest) / kLogWidth);
  ++buckets_[std::min(static_cast<std::size_t>(bucket), kBuckets - 1)];
  ++count_;
  sum_ += milliseconds;
  max_ = std::max(max_, milliseconds);
}

double DurationHistogram::Percentile(double share) const {
  const auto rank = static_cast<long>(share * static_cast<double>(count_ - 1));
  long below = 0;
  for (std::size_t i = 0; i < kBuckets; ++i) {
    below += buckets_[i];
    if (below <= rank) continue;
    constexpr double kMiddle = 0.5;  // of a bucket
    return std::min(max_, kShortest * std::exp((static_cast<double>(i) + kMiddle) * kLogWidth));
  }
  return max_;
}

void StageStatistics::Add(const StageTimes& times) {
  for (const StageTime& time : times) Add(time.stage, time.ms);
}

}  // namespace planar_vslam
