#pragma once
// What the executables of this folder have in common: percentiles as JSON, and the memory in use.
#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <numeric>
#include <string>
#include <vector>

namespace planar_vslam {

// The smallest value that is not exceeded by `share` of them; 0 where there are none.
inline double Percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

// {"count", "mean", "p50", "p99"}; "null" where there are none.
inline std::string TimesJson(const std::vector<double>& ms) {
  if (ms.empty()) return "null";
  const double mean = std::accumulate(ms.begin(), ms.end(), 0.0) / static_cast<double>(ms.size());
  return fmt::format(R"({{"count": {}, "mean": {:.4f}, "p50": {:.4f}, "p99": {:.4f}}})", ms.size(), mean,
                     Percentile(ms, 0.5), Percentile(ms, 0.99));
}

// Allocated and not freed; what the allocator keeps for later does not count.
inline double HeapBytes() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks) + static_cast<double>(info.hblkhd);
}

}  // namespace planar_vslam
