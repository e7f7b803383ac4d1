// What a robot pays that drives the same way again and again, lap by lap.
//   bench_laps RECORDING LAP_SECONDS
// Maps the recording on this thread. A lap ends every LAP_SECONDS after the first image; prints JSON with one entry a
// lap: time of frames that became no keyframe, what those that did took more than the median of these, the map, the
// size of its file, and the memory in use.
#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <system_error>

#include "cost.h"
#include "planar_vslam/io/recording.h"
#include "planar_vslam/map/map_file.h"
#include "planar_vslam/pipeline/estimator.h"

namespace planar_vslam {
namespace {

constexpr double kMebibyte = 1024.0 * 1024.0;

class Laps {
 public:
  Laps(const RecordingInfo& info, double lap_seconds) : estimator_(Settings(info)), lap_seconds_(lap_seconds) {}

  void Take(const RecordedEvent& event) {
    const auto reports = std::visit([this](const auto& measurement) { return estimator_.Add(measurement); }, event);
    for (const FrameReport& report : reports) Take(report);
  }

  // Ends the last lap; the laps as JSON.
  std::string Finish() {
    for (const FrameReport& report : estimator_.Flush()) Take(report);
    if (!frames_.empty()) EndLap();
    return fmt::format("{{\"laps\": [{}]}}", laps_);
  }

 private:
  static EstimatorSettings Settings(const RecordingInfo& info) {
    EstimatorSettings settings;
    settings.camera = info.camera;
    settings.has_base = info.has_base_transform;
    settings.with_odometry = info.has_odometry;
    return settings;
  }

  void Take(const FrameReport& report) {
    if (!lap_begin_.has_value()) lap_begin_ = report.stamp;
    if (SecondsBetween(*lap_begin_, report.stamp) >= lap_seconds_) {
      EndLap();
      lap_begin_->nanoseconds += std::llround(1e9 * lap_seconds_);
    }
    (report.keyframe ? keyframes_ : frames_).push_back(report.total_ms);
    located_ += report.state == TrackingState::kTracking ? 1 : 0;
  }

  void EndLap() {
    const double usual = Percentile(frames_, 0.5);
    const std::size_t images = frames_.size() + keyframes_.size();
    for (double& ms : keyframes_) ms -= usual;
    const std::shared_ptr<const Map> map = estimator_.map();
    laps_ += fmt::format(
        R"({}{{"images": {}, "tracked": {}, "frame_ms": {}, "keyframe_ms": {}, "keyframes": {}, "landmarks": {}, )"
        R"("file_mib": {:.3f}, "heap_mib": {:.3f}}})",
        laps_.empty() ? "" : ", ", images, located_, TimesJson(frames_), TimesJson(keyframes_),
        map == nullptr ? 0 : map->keyframes.size(), map == nullptr ? 0 : map->landmarks.size(), FileMebibytes(map),
        HeapBytes() / kMebibyte);
    frames_.clear();
    keyframes_.clear();
    located_ = 0;
  }

  double FileMebibytes(const std::shared_ptr<const Map>& map) const {
    if (map == nullptr) return 0.0;
    const std::filesystem::path path =
        std::filesystem::temp_directory_path() / fmt::format("bench_laps_{}.pvm", getpid());
    double size = 0.0;
    if (SaveMapFile(*map, estimator_.map_camera(), path).ok()) {
      size = static_cast<double>(std::filesystem::file_size(path)) / kMebibyte;
    }
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
    return size;
  }

  Estimator estimator_;
  const double lap_seconds_;
  std::optional<Timestamp> lap_begin_;
  std::vector<double> frames_, keyframes_;  // ms, of this lap
  long located_ = 0;
  std::string laps_;
};

Expected<std::string> Drive(const std::filesystem::path& path, double lap_seconds) {
  Expected<std::unique_ptr<Recording>> recording = OpenRecording(path, RecordingOptions{});
  if (!recording.ok()) return recording.error();
  Laps laps((*recording)->info(), lap_seconds);
  while (true) {
    const Expected<std::optional<RecordedEvent>> event = (*recording)->Next();
    if (!event.ok()) return event.error();
    if (!event->has_value()) return laps.Finish();
    laps.Take(**event);
  }
}

int Main(int argc, char** argv) {
  const double lap_seconds = argc > 2 ? std::atof(argv[2]) : 0.0;
  if (lap_seconds <= 0.0) {
    fmt::print(stderr, "usage: bench_laps RECORDING LAP_SECONDS\n");
    return 2;
  }
  const Expected<std::string> json = Drive(argv[1], lap_seconds);
  if (!json.ok()) {
    fmt::print(stderr, "bench_laps: {}\n", json.error().message);
    return 2;
  }
  fmt::print("{}\n", *json);
  return 0;
}

}  // namespace
}  // namespace planar_vslam

int main(int argc, char** argv) { return planar_vslam::Main(argc, argv); }
