#pragma once
// A broken promise between our own functions stops the program with file, line and the values involved.
// Expected failure (bad input, too few inliers) is never a check: it is a value (see expected.h).
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>

namespace planar_vslam {

[[noreturn]] inline void FailCheck(const char* file, int line, const char* condition, const std::string& values) {
  std::fprintf(stderr, "%s:%d: check failed: %s %s\n", file, line, condition, values.c_str());
  std::abort();
}

}  // namespace planar_vslam

// PV_CHECK(a < b, "a=" << a << " b=" << b)
#define PV_CHECK(condition, values)                                                     \
  do {                                                                                  \
    if (!(condition)) {                                                                 \
      std::ostringstream pv_check_stream;                                               \
      pv_check_stream << values;                                                        \
      ::planar_vslam::FailCheck(__FILE__, __LINE__, #condition, pv_check_stream.str()); \
    }                                                                                   \
  } while (false)
