#pragma once
// Range checks of option fields, one line per bad field: what, where, what was expected.
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

namespace planar_vslam::internal {

inline void AddProblem(const char* field, double value, const char* expected, std::vector<std::string>* problems) {
  std::ostringstream line;
  line << field << ": expected " << expected << ", got " << value;
  problems->push_back(line.str());
}

// The comparisons are written so that NaN fails them.
inline void ExpectPositive(const char* field, double value, std::vector<std::string>* problems) {
  if (!(std::isfinite(value) && value > 0.0)) AddProblem(field, value, "a finite number > 0", problems);
}
inline void ExpectNotNegative(const char* field, double value, std::vector<std::string>* problems) {
  if (!(std::isfinite(value) && value >= 0.0)) AddProblem(field, value, "a finite number >= 0", problems);
}

}  // namespace planar_vslam::internal
