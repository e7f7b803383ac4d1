#pragma once
// What the subcommands that drive the estimator have in common: configuration, recording, progress.
#include <chrono>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "planar_vslam/io/run_session.h"

namespace planar_vslam {

// The file (none where empty), then the assignments, then the mode (as configured where empty). A configuration with
// problems is an Error.
Expected<PipelineOptions> ReadOptions(const std::filesystem::path& config, const std::vector<std::string>& assignments,
                                      const std::string& mode);

// `odometry`: another odometry file of a dataset folder; empty for its own.
RecordingOptions ToRecordingOptions(const PipelineOptions& options, const std::filesystem::path& odometry);

// One line on stderr, rewritten in place: share done, how many of what, time left.
class ProgressBar {
 public:
  explicit ProgressBar(std::string what = "images") : what_(std::move(what)) {}
  void operator()(long done, long total);

 private:
  std::string what_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now(), last_;
};

}  // namespace planar_vslam
