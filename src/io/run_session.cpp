#include "planar_vslam/io/run_session.h"

#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <thread>
#include <utility>

#include "camera_yaw.h"
#include "planar_vslam/pipeline/findings.h"

namespace planar_vslam {
namespace {

using Clock = std::chrono::steady_clock;

double CpuSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// Plays at `rate` times real time: waits for frames that are early, tells to drop those that are late.
class Pace {
 public:
  explicit Pace(std::optional<double> rate) : rate_(rate) {}

  bool InTime(Timestamp stamp) {
    if (!rate_.has_value()) return true;
    if (!origin_.has_value()) {
      origin_ = {stamp, Clock::now()};
      return true;
    }
    const auto offset = std::chrono::duration<double>(SecondsBetween(origin_->first, stamp) / *rate_);
    const auto due = origin_->second + std::chrono::duration_cast<Clock::duration>(offset);
    // A camera driver keeps one image waiting: later than one typical frame period means the next one has replaced it.
    const auto period = std::chrono::duration<double>(kFramePeriod / *rate_);
    if (Clock::now() > due + period) return false;
    std::this_thread::sleep_until(due);
    return true;
  }

 private:
  static constexpr double kFramePeriod = 0.1;  // s
  std::optional<double> rate_;
  std::optional<std::pair<Timestamp, Clock::time_point>> origin_;
};

class Session {
 public:
  Session(Recording& recording, Estimator& estimator, const RunSettings& settings)
      : recording_(recording),
        estimator_(estimator),
        settings_(settings),
        pace_(settings.rate),
        corrector_(estimator.settings().options.calibration) {}

  Expected<RunResult> Run() {
    const auto wall_start = Clock::now();
    const double cpu_start = CpuSeconds();
    while (true) {
      Expected<std::optional<RecordedEvent>> event = recording_.Next();
      if (!event.ok()) return event.error();
      if (!event->has_value() || IsPastEnd(**event)) break;
      if (IsBeforeStart(**event)) continue;
      std::visit([this](auto&& e) { Take(std::forward<decltype(e)>(e)); }, std::move(**event));
    }
    Keep(estimator_.Flush());
    const Expected<bool> finished = estimator_.Finish();
    if (!finished.ok()) result_.final_adjustment = finished.error().message;
    result_.wall_seconds = std::chrono::duration<double>(Clock::now() - wall_start).count();
    result_.cpu_seconds = CpuSeconds() - cpu_start;
    for (const auto& [reason, count] : estimator_.unused_input()) result_.unused_input[reason] += count;
    for (const auto& [reason, count] : recording_.skipped()) result_.unused_input[reason] += count;
    const RecordingInfo& info = recording_.info();
    const std::shared_ptr<const Map> map = estimator_.map();
    result_.motion = Compare();
    FindingsInput found{estimator_.report(),
                        estimator_.input_watch(),
                        map.get(),
                        result_.unused_input,
                        info.notes,
                        info.has_base_transform,
                        info.has_laser,
                        result_.motion,
                        estimator_.settings().options.scan_match.enabled,
                        estimator_.settings().options.initializer.mode == InitializationMode::kVisual,
                        estimator_.settings().options.image_timing.readout};
    if (MayBeTurned(result_.motion)) found.yaw = io::FindCameraYaw(estimator_, readings_);
    result_.findings = Findings(found);
    if (!result_.frames.empty()) {
      result_.recorded_seconds = SecondsBetween(result_.frames.front().stamp, result_.frames.back().stamp);
    }
    return std::move(result_);
  }

 private:
  // The wheels are read from the first reading on: an image needs one from before it.
  bool IsBeforeStart(const RecordedEvent& event) const {
    if (!settings_.from.has_value()) return false;
    const auto* frame = std::get_if<CameraFrame>(&event);
    const auto* scan = std::get_if<LaserFrame>(&event);
    if (frame == nullptr && scan == nullptr) return false;
    const Timestamp stamp = frame != nullptr ? frame->image.stamp : scan->scan.stamp;
    return SecondsBetween(recording_.info().first_image, stamp) < *settings_.from;
  }
  bool IsPastEnd(const RecordedEvent& event) const {
    const auto* frame = std::get_if<CameraFrame>(&event);
    return settings_.until.has_value() && frame != nullptr &&
           SecondsBetween(recording_.info().first_image, frame->image.stamp) > *settings_.until;
  }

  // Odometry and scans around an image that came too late go to the next one.
  void Take(CameraFrame frame) {
    if (pace_.InTime(frame.image.stamp)) {
      Keep(estimator_.Add(std::move(frame)));
    } else {
      ++result_.frames_dropped;
    }
  }
  void Take(const OdometryReading& reading) {
    if (settings_.on_odometry) settings_.on_odometry(reading);
    if (const std::optional<OdometryReading> continued = continuity_.Push(reading)) {
      wheels_.Push({corrector_.Correct(continued->stamp), continued->T_odom_base});
      if (readings_.size() < kMostReadings && (readings_.empty() || readings_.back().stamp < continued->stamp)) {
        readings_.push_back(*continued);
      }
    }
    Keep(estimator_.Add(reading));
  }
  void Take(LaserFrame frame) { Keep(estimator_.Add(std::move(frame))); }

  // Whether the camera's yaw is worth an adjustment of the map: one that is not too large to be adjusted soon.
  bool MayBeTurned(const MotionAgreement& motion) const {
    const double hint = DegreesToRadians(0.3);  // a map that leans towards the wheels shows a third of a wrong yaw
    constexpr std::size_t kMostKeyframes = 400;
    const std::shared_ptr<const Map> map = estimator_.map();
    const bool small = map != nullptr && map->keyframes.size() < kMostKeyframes && readings_.size() < kMostReadings;
    return small && recording_.info().has_base_transform && motion.direction.has_value() &&
           std::abs(motion.direction->value) > hint;
  }

  MotionAgreement Compare() const {
    std::vector<SeenPose> seen;
    for (const FrameReport& frame : result_.frames) {
      const bool by_sight = frame.state == TrackingState::kTracking && frame.T_map_base.has_value();
      if (by_sight) seen.push_back({frame.stamp, ProjectToPlane(*frame.T_map_base) * frame.T_base_exposed});
    }
    MotionAgreement agreement = CompareMotions(seen, wheels_);
    std::vector<SeenTurn> turns = estimator_.input_watch().laser().turns();
    for (SeenTurn& turn : turns) turn = {corrector_.Correct(turn.from), corrector_.Correct(turn.to), turn.angle};
    agreement.laser_time_offset = CompareTurns(turns, wheels_);
    return agreement;
  }

  // Every so manieth keyframe, so that there are neither few nor many however long the run.
  void KeepScale() {
    constexpr std::size_t kMost = 240;
    const EstimatorReport& report = estimator_.report();
    const std::shared_ptr<const Map> map = estimator_.map();
    if (map == nullptr || !map->metric || report.keyframes_made < next_scale_) return;
    next_scale_ = report.keyframes_made + scale_step_;
    const MapScale& scale = report.map_scale;
    std::vector<ScaleAt>& history = result_.scale_history;
    history.push_back({estimator_.input_watch().wheel_way(), scale.fused, scale.wheels, scale.laser, scale.floor});
    if (history.size() < kMost) return;
    scale_step_ *= 2;
    for (std::size_t i = 1; 2 * i < history.size(); ++i) history[i] = history[2 * i];
    history.resize((history.size() + 1) / 2);
  }

  void Keep(std::vector<FrameReport> reports) {
    if (!reports.empty()) KeepScale();
    for (FrameReport& report : reports) {
      result_.frames.push_back(std::move(report));
      if (!settings_.progress) continue;
      settings_.progress(static_cast<long>(result_.frames.size()) + result_.frames_dropped,
                         recording_.info().image_count);
    }
  }

  Recording& recording_;
  Estimator& estimator_;
  const RunSettings& settings_;
  Pace pace_;
  OdometryContinuity continuity_;
  InputCorrector corrector_;  // of stamps
  OdometryBuffer wheels_;     // on the camera's clock, without their jumps
  static constexpr std::size_t kMostReadings = 50000;
  std::vector<OdometryReading> readings_;  // as they came in, without their jumps; the first of a long drive
  long next_scale_ = 0, scale_step_ = 1;   // keyframes
  RunResult result_;
};

}  // namespace

Expected<RunResult> RunSession(Recording& recording, Estimator& estimator, const RunSettings& settings) {
  return Session(recording, estimator, settings).Run();
}

}  // namespace planar_vslam
