#pragma once
// How long the stages of tracking and mapping take: percentiles in bounded memory, whatever the length of the run.
#include <array>
#include <cstdint>
#include <map>
#include <string>

#include "planar_vslam/geometry/stopwatch.h"

namespace planar_vslam {

// Durations counted in buckets that are 5 % wide: percentiles are good to 2.5 %.
class DurationHistogram {
 public:
  void Add(double milliseconds);

  long count() const { return count_; }
  double sum() const { return sum_; }  // ms
  double max() const { return max_; }  // ms
  // ms, of the shortest `share` of the durations; 0 where there are none.
  double Percentile(double share) const;

 private:
  static constexpr std::size_t kBuckets = 384;  // from a microsecond to two minutes

  std::array<std::uint32_t, kBuckets> buckets_{};
  long count_ = 0;
  double sum_ = 0.0, max_ = 0.0;
};

class StageStatistics {
 public:
  void Add(const std::string& stage, double milliseconds) { stages_[stage].Add(milliseconds); }
  void Add(const StageTimes& times);

  // By name, which orders stages of one part together: "map.triangulate", "bundle.jacobians".
  const std::map<std::string, DurationHistogram>& stages() const { return stages_; }

 private:
  std::map<std::string, DurationHistogram> stages_;
};

}  // namespace planar_vslam
