// Hours of localisation in a saved map, as the node does it: memory and time per frame must not grow.
//   bench_endurance DATASET_FOLDER MAP.pvm [MINUTES=60]
// The recorded drive is driven forth and back without a jump until so many minutes of it have passed; one line a
// minute.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "planar_vslam/io/recording.h"
#include "planar_vslam/map/map_file.h"
#include "planar_vslam/pipeline/estimator.h"

namespace planar_vslam {
namespace {

double ResidentMebibytes() {
  long pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return static_cast<double>(resident * sysconf(_SC_PAGESIZE)) / (1024.0 * 1024.0);
}

struct Recorded {
  CameraModel camera;
  std::vector<RecordedEvent> events;
};

Expected<Recorded> ReadAll(const std::filesystem::path& folder) {
  Expected<std::unique_ptr<Recording>> recording = OpenRecording(folder, RecordingOptions{});
  if (!recording.ok()) return recording.error();
  Recorded recorded{(*recording)->info().camera, {}};
  while (true) {
    Expected<std::optional<RecordedEvent>> event = (*recording)->Next();
    if (!event.ok()) return event.error();
    if (!event->has_value()) return recorded;
    recorded.events.push_back(std::move(**event));
  }
}

Timestamp StampOf(const RecordedEvent& event) {
  if (const auto* frame = std::get_if<CameraFrame>(&event)) return frame->image.stamp;
  if (const auto* frame = std::get_if<LaserFrame>(&event)) return frame->scan.stamp;
  return std::get<OdometryReading>(event).stamp;
}

RecordedEvent At(RecordedEvent event, Timestamp stamp) {
  if (auto* frame = std::get_if<CameraFrame>(&event)) {
    frame->image.stamp = stamp;
  } else if (auto* laser = std::get_if<LaserFrame>(&event)) {
    laser->scan.stamp = stamp;
  } else {
    std::get<OdometryReading>(event).stamp = stamp;
  }
  return event;
}

class Endurance {
 public:
  Endurance(const Recorded& recorded, Estimator* estimator) : recorded_(recorded), estimator_(estimator) {}

  void Run(double minutes) {
    begin_ = StampOf(recorded_.events.front());
    fmt::print("minute  memory MiB  frame ms: p50    p99  localised %\n");
    for (bool forth = true; minute_ < static_cast<int>(minutes); forth = !forth) Pass(forth);
  }

 private:
  // Backwards in time the stamps mirror those of the way forth; the turning point is not passed twice.
  void Pass(bool forth) {
    const Timestamp first = StampOf(recorded_.events.front()), last = StampOf(recorded_.events.back());
    constexpr std::int64_t kPause = 1'000'000;  // ns, between the last event and the first of the next pass
    const std::size_t count = recorded_.events.size();
    for (std::size_t k = 0; k < count; ++k) {
      const RecordedEvent& event = recorded_.events[forth ? k : count - 1 - k];
      const std::int64_t passed =
          forth ? StampOf(event).nanoseconds - first.nanoseconds : last.nanoseconds - StampOf(event).nanoseconds;
      Take(At(event, Timestamp{begin_.nanoseconds + passed}));
    }
    begin_.nanoseconds += last.nanoseconds - first.nanoseconds + kPause;
  }

  void Take(const RecordedEvent& event) {
    const auto reports = std::visit([this](const auto& measurement) { return estimator_->Add(measurement); }, event);
    for (const FrameReport& report : reports) {
      milliseconds_.push_back(report.total_ms);
      located_ += report.T_map_base.has_value() ? 1 : 0;
      if (!start_.has_value()) start_ = report.stamp;
      if (SecondsBetween(*start_, report.stamp) >= 60.0 * (minute_ + 1)) PrintMinute();
    }
  }

  void PrintMinute() {
    std::sort(milliseconds_.begin(), milliseconds_.end());
    const auto at = [this](double share) {
      return milliseconds_[static_cast<std::size_t>(share * static_cast<double>(milliseconds_.size() - 1))];
    };
    fmt::print("{:6} {:11.1f} {:14.2f} {:6.2f} {:12.1f}\n", ++minute_, ResidentMebibytes(), at(0.5), at(0.99),
               100.0 * static_cast<double>(located_) / static_cast<double>(milliseconds_.size()));
    std::fflush(stdout);
    milliseconds_.clear();
    located_ = 0;
  }

  const Recorded& recorded_;
  Estimator* estimator_;
  Timestamp begin_;  // of the pass
  std::optional<Timestamp> start_;
  std::vector<double> milliseconds_;
  long located_ = 0;
  int minute_ = 0;
};

int Main(int argc, char** argv) {
  if (argc < 3) {
    fmt::print(stderr, "usage: bench_endurance DATASET_FOLDER MAP.pvm [MINUTES=60]\n");
    return 2;
  }
  const Expected<Recorded> recorded = ReadAll(argv[1]);
  const Expected<SavedMap> saved = LoadMapFile(argv[2]);
  if (!recorded.ok() || !saved.ok()) {
    fmt::print(stderr, "bench_endurance: {}\n", (recorded.ok() ? saved.error() : recorded.error()).message);
    return 2;
  }
  EstimatorSettings settings;
  settings.camera = recorded->camera;
  settings.options.mode = RunMode::kLocalization;
  settings.schedule = Schedule::kThreaded;
  settings.trajectory_frames = 3000;  // the node's ~path_frames
  Estimator estimator(settings);
  if (const Expected<bool> loaded = estimator.LoadMap(*saved); !loaded.ok()) {
    fmt::print(stderr, "bench_endurance: {}: {}\n", argv[2], loaded.error().message);
    return 2;
  }
  Endurance(*recorded, &estimator).Run(argc > 3 ? std::atof(argv[3]) : 60.0);
  return 0;
}

}  // namespace
}  // namespace planar_vslam

int main(int argc, char** argv) { return planar_vslam::Main(argc, argv); }
