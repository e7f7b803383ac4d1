#include "planar_vslam/io/run_session.h"

#include <sys/resource.h>

#include <chrono>
#include <thread>
#include <type_traits>
#include <utility>

#include "planar_vslam/pipeline/input_corrector.h"

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
  Session(Recording& recording, SlamSystem& system, const RunSettings& settings)
      : recording_(recording),
        system_(system),
        settings_(settings),
        corrector_(system.options().calibration),
        synchronizer_(recording.info().has_odometry && settings.use_odometry),
        pace_(settings.rate) {}

  Expected<RunResult> Run() {
    const auto wall_start = Clock::now();
    const double cpu_start = CpuSeconds();
    while (true) {
      Expected<std::optional<RecordedEvent>> event = recording_.Next();
      if (!event.ok()) return event.error();
      if (!event->has_value() || IsPastEnd(**event)) break;
      std::visit([this](auto&& e) { Take(std::forward<decltype(e)>(e)); }, std::move(**event));
      Drain();
    }
    synchronizer_.Finish();
    Drain();
    system_.Finish();
    result_.wall_seconds = std::chrono::duration<double>(Clock::now() - wall_start).count();
    result_.cpu_seconds = CpuSeconds() - cpu_start;
    for (const auto& [reason, count] : synchronizer_.dropped()) result_.unused_input[reason] += count;
    for (const auto& [reason, count] : recording_.skipped()) result_.unused_input[reason] += count;
    if (!result_.frames.empty()) {
      result_.recorded_seconds = SecondsBetween(result_.frames.front().stamp, result_.frames.back().stamp);
    }
    return std::move(result_);
  }

 private:
  bool IsPastEnd(const RecordedEvent& event) const {
    const auto* frame = std::get_if<CameraFrame>(&event);
    return settings_.until.has_value() && frame != nullptr &&
           SecondsBetween(recording_.info().first_image, frame->image.stamp) > *settings_.until;
  }

  template <class Measurement>
  void Take(Measurement&& measurement) {
    if constexpr (std::is_same_v<std::decay_t<Measurement>, OdometryReading>) {
      if (settings_.on_odometry) settings_.on_odometry(measurement);
    }
    synchronizer_.Push(corrector_.Correct(std::forward<Measurement>(measurement)));
  }

  void Drain() {
    while (std::optional<FramePacket> packet = synchronizer_.Pop()) {
      if (!pace_.InTime(packet->image.stamp)) {
        ++result_.frames_dropped;
        KeepMeasurements(std::move(*packet));
        continue;
      }
      PrependMeasurements(&*packet);
      result_.frames.push_back(system_.Process(*packet));
      if (settings_.progress)
        settings_.progress(static_cast<long>(result_.frames.size()) + result_.frames_dropped,
                           recording_.info().image_count);
    }
  }

  // The odometry and scans of a dropped image go to the next one.
  void KeepMeasurements(FramePacket packet) {
    PrependMeasurements(&packet);
    kept_ = std::move(packet);
    kept_->image.image = GrayImage{};
  }
  void PrependMeasurements(FramePacket* packet) {
    if (!kept_.has_value()) return;
    std::vector<OdometryReading> odometry = std::move(kept_->odometry);
    if (!packet->T_odom_base.has_value()) odometry.clear();  // it would not reach this image
    if (!odometry.empty() && !packet->odometry.empty()) packet->odometry.erase(packet->odometry.begin());
    packet->odometry.insert(packet->odometry.begin(), odometry.begin(), odometry.end());
    std::vector<ScanPacket> scans = std::move(kept_->scans);
    if (kept_->T_odom_base.has_value() && packet->T_odom_base.has_value()) {
      const Rigid2 T_new_old = packet->T_odom_base->Inverse() * *kept_->T_odom_base;
      for (ScanPacket& scan : scans) scan.T_frame_base = T_new_old * scan.T_frame_base;
      packet->scans.insert(packet->scans.begin(), std::make_move_iterator(scans.begin()),
                           std::make_move_iterator(scans.end()));
    }
    kept_.reset();
  }

  Recording& recording_;
  SlamSystem& system_;
  const RunSettings& settings_;
  InputCorrector corrector_;
  Synchronizer synchronizer_;
  Pace pace_;
  std::optional<FramePacket> kept_;
  RunResult result_;
};

}  // namespace

Expected<RunResult> RunSession(Recording& recording, SlamSystem& system, const RunSettings& settings) {
  return Session(recording, system, settings).Run();
}

}  // namespace planar_vslam
