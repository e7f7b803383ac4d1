#include "skip_log.h"

#include <fmt/format.h>

#include <cstdio>

namespace planar_vslam::io {

void SkipLog::Count(const std::string& reason, const std::string& where) {
  const long count = ++counts_[reason];
  if (count > 1) return;
  const std::string line =
      fmt::format("planar_vslam: skipped: {} ({}); more of the kind are only counted\n", reason, where);
  std::fputs(line.c_str(), stderr);
}

}  // namespace planar_vslam::io
