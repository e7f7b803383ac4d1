#pragma once
// Median of some numbers: the upper of the two middle ones where their count is even, 0 of none.
#include <algorithm>
#include <cstddef>
#include <vector>

namespace planar_vslam {

inline double Median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace planar_vslam
