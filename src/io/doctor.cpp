#include "planar_vslam/io/doctor.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "doctor_trial.h"
#include "planar_vslam/geometry/median.h"
#include "planar_vslam/pipeline/findings.h"
#include "planar_vslam/pipeline/input_watch.h"
#include "planar_vslam/sensor/lens.h"

namespace planar_vslam {
namespace {

double Rate(const StreamRhythm& stream) {
  constexpr double kMillisecondsPerSecond = 1e3;
  const double usual = stream.intervals.Percentile(0.5);
  return usual > 0.0 ? kMillisecondsPerSecond / usual : 0.0;
}

// Mean step between neighbours of a row over the mean grey: how much of the picture is edges.
double Sharpness(const GrayImage& image) {
  constexpr int kEvery = 4;
  double steps = 0.0, grey = 1.0;
  for (int row = 0; row < image.height; row += kEvery) {
    const std::uint8_t* pixels = image.pixels->data() + static_cast<std::ptrdiff_t>(row) * image.width;
    for (int column = 1; column < image.width; ++column) {
      steps += std::abs(static_cast<double>(pixels[column]) - static_cast<double>(pixels[column - 1]));
      grey += pixels[column];
    }
  }
  return steps / grey;
}

class Examination {
 public:
  explicit Examination(const RecordingInfo& info) : info_(info) {}

  void Take(const CameraFrame& frame) {
    watch_.Add(frame);
    ++images_;
    if (!frame.image.image.empty()) sharpness_.push_back(Sharpness(frame.image.image));
  }
  void Take(const OdometryReading& reading) { watch_.Add(reading); }
  void Take(const LaserFrame& frame) { watch_.Add(frame); }

  long images() const { return images_; }

  std::vector<Checked> Conclude(const io::Trial& trial, const io::Trial* by_images,
                                std::map<std::string, long> unused) {
    const std::shared_ptr<const Map> map = trial.estimator->map();
    FindingsInput input{trial.estimator->report(), watch_,          map.get(), std::move(unused), {},
                        info_.has_base_transform,  info_.has_laser, {}};
    input.motion = trial.result.motion;
    const PipelineOptions& options = trial.estimator->settings().options;
    input.laser_is_matched = options.scan_match.enabled;
    input.starts_by_images = options.initializer.mode == InitializationMode::kVisual;
    input.yaw = trial.yaw;
    if (!input.motion.time_offset.has_value() && by_images != nullptr) {
      input.motion.time_offset = by_images->result.motion.time_offset;
    }
    found_ = FindAll(input);
    if (by_images != nullptr) AddSigns(by_images->result.motion);
    if (Found("odometry", Harm::kWorthless)) DropLaser();
    if (!info_.topics.empty()) Add("topics", info_.topics);
    if (!info_.frames.empty()) Add("tf", info_.frames);
    AddCamera();
    AddImages();
    AddMount();
    AddOdometry(trial.result.motion);
    AddLaser();
    AddMap(map.get());
    AddRest();
    return std::move(checked_);
  }

 private:
  static bool Forwards(const MotionAgreement& motion) {
    return !motion.direction.has_value() || std::abs(motion.direction->value) < M_PI_2;
  }

  bool Found(const char* what, Harm at_least = Harm::kMissing) const {
    return std::any_of(found_.begin(), found_.end(), [what, at_least](const Finding& finding) {
      return std::string(finding.subject) == what && finding.harm >= at_least;
    });
  }

  // Against wheels that are wrong any laser looks wrong.
  void DropLaser() {
    const auto is_laser = [](const Finding& finding) { return std::string(finding.subject) == "laser"; };
    found_.erase(std::remove_if(found_.begin(), found_.end(), is_laser), found_.end());
  }

  // What only a map without the wheels shows.
  void AddSigns(const MotionAgreement& motion) {
    constexpr double kOpposite = -1.5;  // as far, but the other way: -2
    if (motion.turn.has_value() && motion.turn->value < kOpposite) {
      found_.push_back(
          {Harm::kWorthless, "odometry",
           "the wheels turn the other way than the images: the sign of the odometry's yaw is wrong, or the "
           "camera hangs upside down against its tf"});
    }
    if (!Forwards(motion)) {
      found_.push_back({Harm::kWorthless, "odometry",
                        "the wheels drive backwards where the images go forwards: the sign of the odometry or the "
                        "direction of the camera in tf is wrong"});
    }
  }

  // One line where nothing is wrong, else one for each thing that is.
  void Add(const char* what, const std::string& facts) {
    bool first = true;
    for (const Finding& finding : found_) {
      if (std::string(finding.subject) != what) continue;
      const Verdict verdict = finding.harm == Harm::kWorthless ? Verdict::kBroken : Verdict::kLook;
      checked_.push_back({verdict, what, first && !facts.empty() ? facts + ". " + finding.text : finding.text});
      first = false;
    }
    if (first && !facts.empty()) checked_.push_back({Verdict::kOk, what, facts});
  }

  void AddCamera() {
    const CameraModel& camera = info_.camera;
    const double degrees = 2.0 * RadiansToDegrees(std::atan(0.5 * camera.width / camera.fx));
    constexpr double kNarrow = 25.0, kWide = 140.0;
    if (degrees < kNarrow || (degrees > kWide && camera.lens == Lens::kRadial)) {
      found_.push_back({Harm::kBent, "camera", "is the calibration that of this camera at this resolution?"});
    }
    Add("camera", fmt::format("{}x{} px, {}, focal length {:.0f} px, {:.0f} deg wide", camera.width, camera.height,
                              camera.distorted() ? DescribeLens(camera).model : "no distortion", camera.fx, degrees));
  }

  void AddImages() {
    constexpr double kBlurred = 0.4, kOften = 0.25;  // of the usual sharpness; of the images
    double blurred = 0.0;
    const double usual = Median(sharpness_);
    for (const double sharpness : sharpness_) blurred += sharpness < kBlurred * usual ? 1.0 : 0.0;
    const double share = sharpness_.empty() ? 0.0 : blurred / static_cast<double>(sharpness_.size());
    if (share > kOften) {
      found_.push_back({Harm::kMissing, "images", "many are blurred or empty; shorten the exposure, or drive slower"});
    }
    if (images_ == 0) found_.push_back({Harm::kWorthless, "images", "none can be used"});
    Add("images", fmt::format("{}, {:.1f} a second; {:.0f} % dark, {:.0f} % bright, {:.0f} % blurred", images_,
                              Rate(watch_.images()), 100.0 * watch_.dark_images(), 100.0 * watch_.bright_images(),
                              100.0 * share));
  }

  void AddMount() {
    if (!info_.has_base_transform) {
      found_.push_back(
          {Harm::kMissing, "mount", "no tf from the base to the camera: handheld, without floor and wheels"});
      return Add("mount", "");
    }
    if (!watch_.T_base_camera().has_value()) return Add("mount", "");
    const Rigid3& T = *watch_.T_base_camera();
    const Eigen::Vector3d axis = T.R().col(2);
    Add("mount", fmt::format("camera {:.2f} m high, looks {:.0f} deg to the left and {:.0f} deg down",
                             T.translation.z(), RadiansToDegrees(std::atan2(axis.y(), axis.x())),
                             -RadiansToDegrees(std::asin(std::clamp(axis.z(), -1.0, 1.0)))));
  }

  void AddOdometry(const MotionAgreement& motion) {
    if (!info_.has_odometry) {
      found_.push_back({Harm::kMissing, "odometry", "none: the map will have no scale, and there will be no grid"});
      Add("odometry", "");
      return Add("clocks", "");
    }
    Add("odometry", fmt::format("{:.0f} a second, {:.1f} m at up to {:.2f} m/s", Rate(watch_.odometry()),
                                watch_.wheel_way(), watch_.wheel_speed()));
    Add("clocks", motion.time_offset.has_value()
                      ? fmt::format("odometry's stamps are {:+.0f} +- {:.0f} ms from the images'",
                                    1e3 * motion.time_offset->value, 1e3 * motion.time_offset->sigma)
                      : std::string("too few turns to compare those of images and odometry"));
  }

  void AddLaser() {
    if (!info_.has_laser) return Add("laser", "none: the grid will show textured surfaces only");
    Add("laser", fmt::format("{:.1f} sweeps a second; turns with the wheels {} times, against them {} times",
                             Rate(watch_.scans()), watch_.laser().agree(), watch_.laser().mirrored()));
  }

  void AddMap(const Map* map) {
    Add("scale", map != nullptr && map->metric && !Found("scale") ? "its sources agree" : "");
    Add("map", map == nullptr ? std::string("none came about on trial")
                              : fmt::format("on trial: {} keyframes, {} points, {}", map->keyframes.size(),
                                            map->landmarks.size(), map->metric ? "metric" : "scale unknown"));
  }

  void AddRest() {
    Add("input", "");
    for (const std::string& note : info_.notes) checked_.push_back({Verdict::kLook, "input", note});
  }

  const RecordingInfo info_;
  InputWatch watch_;
  long images_ = 0;
  std::vector<double> sharpness_;
  std::vector<Finding> found_;
  std::vector<Checked> checked_;
};

using Open = std::function<Expected<std::unique_ptr<Recording>>()>;

// Once from end to end. What cannot be used is left in `skipped`.
std::optional<Error> LookThrough(Recording& recording, const DoctorSettings& settings, Examination* examination) {
  while (true) {
    Expected<std::optional<RecordedEvent>> event = recording.Next();
    if (!event.ok()) return event.error();
    if (!event->has_value()) return std::nullopt;
    std::visit([examination](const auto& content) { examination->Take(content); }, **event);
    const bool image = std::holds_alternative<CameraFrame>(**event);
    if (image && settings.progress) settings.progress(examination->images(), 2 * recording.info().image_count);
  }
}

// Whether the wheels contradict the images so often that only a map without them can tell why.
bool WheelsSpoil(const io::Trial& trial) {
  constexpr double kShare = 0.1;
  const EstimatorReport& report = trial.estimator->report();
  const auto steps = static_cast<double>(report.odometry_by_model + report.odometry_by_messages);
  return HardlyMapped(report, trial.estimator->map().get()) ||
         static_cast<double>(report.odometry_rejected) > kShare * steps;
}

}  // namespace

Expected<std::vector<Checked>> Examine(const Open& open, const PipelineOptions& options,
                                       const DoctorSettings& settings) {
  Expected<std::unique_ptr<Recording>> recording = open();
  if (!recording.ok()) return recording.error();
  const RecordingInfo info = (*recording)->info();
  Examination examination(info);
  if (const auto error = LookThrough(**recording, settings, &examination)) return *error;
  const std::map<std::string, long> skipped = (*recording)->skipped();
  RunSettings run;
  run.until = settings.trial;
  if (settings.progress) {
    run.progress = [&settings](long done, long total) { settings.progress(total + done, 2 * total); };
  }
  Expected<std::unique_ptr<Recording>> again = open();
  if (!again.ok()) return again.error();
  const Expected<io::Trial> trial = io::MapOnTrial(**again, options, run);
  if (!trial.ok()) return trial.error();
  std::optional<io::Trial> by_images;
  if (info.has_odometry && WheelsSpoil(*trial)) {
    again = open();
    if (!again.ok()) return again.error();
    Expected<io::Trial> second = io::MapByImages(**again, options, run);
    if (!second.ok()) return second.error();
    by_images = std::move(*second);
  }
  if (settings.progress) settings.progress(2 * info.image_count, 2 * info.image_count);
  return examination.Conclude(*trial, by_images.has_value() ? &*by_images : nullptr, skipped);
}

std::string ToString(Verdict verdict) {
  if (verdict == Verdict::kOk) return "ok";
  return verdict == Verdict::kLook ? "look" : "broken";
}

std::string ToJson(const std::vector<Checked>& checked) {
  nlohmann::ordered_json lines = nlohmann::ordered_json::array();
  for (const Checked& item : checked) {
    lines.push_back({{"verdict", ToString(item.verdict)}, {"what", item.what}, {"text", item.text}});
  }
  return lines.dump(2) + "\n";
}

}  // namespace planar_vslam
