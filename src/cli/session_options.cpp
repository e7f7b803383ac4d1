#include "session_options.h"

#include <fmt/format.h>

#include <cstdio>
#include <utility>

namespace planar_vslam {

Expected<PipelineOptions> ReadOptions(const std::filesystem::path& config, const std::vector<std::string>& assignments,
                                      const std::string& mode) {
  std::vector<std::string> all = assignments, problems;
  if (!mode.empty()) all.push_back("mode=" + mode);
  PipelineOptions options = CollectOptions(config, all, &problems);
  if (!problems.empty()) return Error{fmt::format("configuration: {}", fmt::join(problems, "; "))};
  return options;
}

RecordingOptions ToRecordingOptions(const PipelineOptions& options, const std::filesystem::path& odometry) {
  RecordingOptions recording;
  const TopicOptions& topics = options.topics;
  recording.bag = {topics.image,      topics.camera_info, topics.odometry, topics.scan,
                   topics.base_frame, topics.odom_frame,  topics.rectified};
  if (!odometry.empty()) recording.odometry_file = odometry;
  recording.require_odometry = options.odometry == OdometryUse::kRequired;
  return recording;
}

void ProgressBar::operator()(long done, long total) {
  const auto now = std::chrono::steady_clock::now();
  if (done < total && now - last_ < std::chrono::milliseconds(200)) return;
  last_ = now;
  const double share = total > 0 ? static_cast<double>(done) / static_cast<double>(total) : 1.0;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const double left = share > 0.0 ? elapsed * (1.0 - share) / share : 0.0;
  constexpr int kWidth = 30;
  const auto filled = static_cast<std::size_t>(share * kWidth);
  std::fprintf(stderr, "\r[%s%s] %3.0f %%  %ld/%ld %s  %.0f s left   ", std::string(filled, '#').c_str(),
               std::string(kWidth - filled, '.').c_str(), 100.0 * share, done, total, what_.c_str(), left);
  if (done >= total) std::fprintf(stderr, "\n");
}

}  // namespace planar_vslam
