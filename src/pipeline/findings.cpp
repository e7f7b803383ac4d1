#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "findings_parts.h"

namespace planar_vslam {
namespace {

// Limits beyond what drives with good sensors show (chosen by looking at simulated and recorded ones).
constexpr double kScaleSigmas = 4.0;   // between two sources of scale ...
constexpr double kScaleShare = 0.015;  // ... and at least so much
constexpr double kIrregular = 1.6;     // mean over usual interval between images
constexpr double kUnusedShare = 0.2;   // of a stream's messages
constexpr double kHung = 3.0;          // s that nothing new comes, which no robot that drives has by chance

// Whether wheels or clocks are so wrong that nothing can be compared with them.
bool WheelsAreWorthless(const Found& found) {
  return std::any_of(found.begin(), found.end(), [](const Finding& finding) {
    const std::string subject = finding.subject;
    return finding.harm == Harm::kWorthless && (subject == "odometry" || subject == "clocks");
  });
}

struct ScaleSource {
  const char* name;
  const char* cure;
  ScaleMeasurement says;
  double sigma;  // of what it says in this drive
};

// A third one that is nearer to `worst` than to the first one, which is believed.
const ScaleSource* WitnessFor(const ScaleSource& worst, const std::vector<ScaleSource>& sources) {
  for (std::size_t i = 1; i < sources.size(); ++i) {
    const double from_first = sources[i].says.log_scale - sources[0].says.log_scale;
    const double from_worst = sources[i].says.log_scale - worst.says.log_scale;
    if (&sources[i] != &worst && std::abs(from_worst) < std::abs(from_first)) return &sources[i];
  }
  return nullptr;
}

// The two that disagree most; the camera's height is none of them where it is wrong.
void AddScale(const FindingsInput& in, bool height_is_wrong, Found* found) {
  if (in.map == nullptr || !in.map->metric || WheelsAreWorthless(*found)) return;
  const MapScale& scale = in.report.map_scale;
  std::vector<ScaleSource> sources;
  if (scale.laser.has_value())
    sources.push_back({"the laser", "check the laser's ranges", *scale.laser, scale.laser->sigma});
  if (scale.wheels.has_value()) {
    ScaleMeasurement as_read = *scale.wheels;  // not as the map's links were corrected
    as_read.log_scale -= in.report.wheels.log_length;
    // How far they are off is what is asked, so what any wheels may be off by is no excuse.
    const double learned = in.report.wheels.length_sigma;
    const double sigma = learned > 0.0 ? std::min(as_read.sigma, learned) : as_read.sigma;
    sources.push_back({"the wheels", "run `planar_vslam calibrate`", as_read, sigma});
  }
  constexpr double kMostlyOnFloor = 0.2;  // share off it; height over another level says nothing
  if (scale.floor.has_value() && !height_is_wrong && OffFloor(in.map) < kMostlyOnFloor) {
    sources.push_back(
        {"the camera's height over the floor", "check its height in tf", *scale.floor, scale.floor->sigma});
  }
  std::sort(sources.begin(), sources.end(),
            [](const ScaleSource& a, const ScaleSource& b) { return a.says.sigma < b.says.sigma; });
  const ScaleSource* worst = nullptr;
  double most = kScaleSigmas;
  for (std::size_t i = 1; i < sources.size(); ++i) {
    const double difference = sources[i].says.log_scale - sources[0].says.log_scale;
    const double sigmas = std::abs(difference) / std::hypot(sources[i].sigma, sources[0].sigma);
    if (std::abs(difference) < kScaleShare || sigmas < most) continue;
    most = sigmas;
    worst = &sources[i];
  }
  if (worst == nullptr) return;
  const double share = worst->says.log_scale - sources[0].says.log_scale;
  std::string name = worst->name, cure = worst->cure;
  if (const ScaleSource* witness = WitnessFor(*worst, sources)) {
    name += fmt::format(" (and {})", witness->name);
    cure = sources[0].cure;
  } else {
    cure += fmt::format(", or {}", sources[0].cure);
  }
  found->push_back({Harm::kBent, "scale",
                    fmt::format("scale: by {} everything is {:.1f} % {} than by {}, which is believed; {}", name,
                                100.0 * std::abs(share), share > 0.0 ? "larger" : "smaller", sources[0].name, cure)});
}

// Of streams that do not last as long as the images. Those that never meet them are told elsewhere.
void AddEnds(const FindingsInput& in, Found* found) {
  constexpr double kLeast = 2.0;  // s: drivers do not start at once
  const StreamRhythm& images = in.input.images();
  if (!in.recorded) return;
  const auto& clocks = in.motion.time_offset;
  if (clocks.has_value() && std::abs(clocks->value) > 0.5 * kLeast) return;  // told by that
  const std::pair<const char*, const StreamRhythm*> streams[] = {{"odometry", &in.input.odometry()},
                                                                 {"the laser", &in.input.scans()}};
  for (const auto& [name, stream] : streams) {
    if (stream->Apart(images) != 0.0) continue;
    const char* subject = stream == &in.input.scans() ? "laser" : "odometry";
    const double late = stream->StartsAfter(images), early = stream->EndsBefore(images);
    if (late > kLeast) {
      found->push_back(
          {Harm::kMissing, subject,
           fmt::format("{} starts {:.1f} s after the images: start its driver before recording", name, late)});
    }
    if (early > kLeast) {
      found->push_back({Harm::kMissing, subject,
                        fmt::format("{} ends {:.1f} s before the images: its driver stopped", name, early)});
    }
  }
}

void AddStreams(const FindingsInput& in, Found* found) {
  constexpr double kOld = 0.1;  // of the images
  const double taken = static_cast<double>(in.input.images().intervals.count()) + 1.0;
  if (static_cast<double>(in.input.old_images()) > kOld * taken || in.input.images_hung() > kHung) {
    found->push_back({Harm::kWorthless, "images",
                      fmt::format("{} of {:.0f} images are the same as before although the wheels drove on: the "
                                  "camera or its driver hangs",
                                  in.input.old_images(), taken)});
  }
  // In a map that stays as it is the way may lead where that map has not been.
  if (in.report.keyframes_made > 0 && IsBlind(in.report) && !HardlyMapped(in.report, in.map)) {
    found->push_back({Harm::kBent, "images",
                      fmt::format("{} poses are by the wheels, {} by sight: the images show too little, or mount, "
                                  "calibration or stamps of the camera are wrong",
                                  FramesIn(in.report, TrackingState::kOdometry),
                                  FramesIn(in.report, TrackingState::kTracking) +
                                      FramesIn(in.report, TrackingState::kRelocalized))});
  }
  const StreamRhythm& images = in.input.images();
  constexpr double kUsual = 0.1;  // share of the intervals that are no longer than the usual one
  constexpr long kFewestImages = 30;
  const double usual = images.intervals.Percentile(kUsual);
  const long count = images.intervals.count() - images.holes;
  const double seconds = 1e-3 * images.intervals.sum() - images.all_holes;
  const double mean = count > 0 ? 1e3 * seconds / static_cast<double>(count) : 0.0;  // ms
  if (count > kFewestImages && mean > kIrregular * usual) {
    found->push_back(
        {Harm::kMissing, "images",
         fmt::format("images come {:.1f} times a second where the camera takes {:.1f}: {:.0f} % are lost on "
                     "the way; record fewer topics, or compressed images",
                     1e3 / mean, 1e3 / usual, 100.0 * (1.0 - usual / mean))});
  }
  const std::pair<const char*, const StreamRhythm*> streams[] = {{"images", &images},
                                                                 {"odometry", &in.input.odometry()}};
  for (const auto& [name, stream] : streams) {
    if (stream->holes == 0) continue;
    const double typical = stream->intervals.Percentile(0.5);
    if (typical > 1e3) continue;  // as slow throughout
    found->push_back({Harm::kMissing, "images",
                      fmt::format("{}: {} hole(s) of up to {:.1f} s; look at the recording's buffers", name,
                                  stream->holes, stream->longest_hole)});
  }
  constexpr double kManyImages = 0.2;
  if (in.input.dark_images() > kManyImages) {
    found->push_back({Harm::kMissing, "images",
                      fmt::format("{:.0f} % of the images are almost black; check exposure and lens cap",
                                  100.0 * in.input.dark_images())});
  }
  if (in.input.bright_images() > kManyImages) {
    found->push_back(
        {Harm::kMissing, "images",
         fmt::format("{:.0f} % of the images are almost white; check the exposure", 100.0 * in.input.bright_images())});
  }
}

// Images skewed by turns. What they show is a part of the readout, so how long it is cannot be told.
void AddShutter(const FindingsInput& in, Found* found) {
  constexpr double kLeast = 0.004, kSure = 6.0;  // s, sigmas
  const std::optional<Deviation>& missed = in.report.missed_readout;
  if (!missed.has_value() || std::abs(missed->value) < std::max(kLeast, kSure * missed->sigma)) return;
  const double ms = 1e3 * std::abs(missed->value);
  const bool longer = missed->value > 0.0;
  found->push_back(
      {Harm::kMissing, "images",
       in.readout != 0.0
           ? fmt::format(
                 "the images' rows seem to take {:.0f} ms or more {} than image_timing.readout says: look it up "
                 "in the camera's data sheet",
                 ms, longer ? "longer" : "less")
           : fmt::format(
                 "the images' rows are taken one after the other, {:.0f} ms or more from {} (a rolling shutter): "
                 "set image_timing.readout to what the camera's data sheet says, {} s as a rule",
                 ms, longer ? "first to last" : "last to first", longer ? "0.01 to 0.03" : "-0.03 to -0.01")});
}

void AddLaser(const FindingsInput& in, Found* found) {
  constexpr double kOld = 0.2;  // of the sweeps
  const double sweeps = static_cast<double>(in.input.scans().intervals.count()) + 1.0;
  if (static_cast<double>(in.input.old_sweeps()) > kOld * sweeps || in.input.sweeps_hung() > kHung) {
    found->push_back({Harm::kWorthless, "laser",
                      fmt::format("{} of {:.0f} sweeps are the same as before although the wheels drove on, and not "
                                  "used: the laser or its driver hangs",
                                  in.input.old_sweeps(), sweeps)});
    return;
  }
  if (in.has_laser && in.input.laser().IsUpsideDown()) {
    found->push_back({Harm::kWorthless, "laser",
                      "the sweeps turn the other way than the wheels: the laser hangs upside down against its mount in "
                      "tf; correct the roll of its frame"});
    return;
  }
  const std::optional<double> turned = in.input.laser().Turned();
  if (in.has_laser && turned.has_value() && !WheelsAreWorthless(*found)) {
    found->push_back({Harm::kWorthless, "laser",
                      fmt::format("by the wheels' way the laser looks about {:.0f} deg further to the {} than tf says: "
                                  "correct the yaw of its frame",
                                  RadiansToDegrees(std::abs(*turned)), *turned > 0.0 ? "left" : "right")});
    return;
  }
  const bool in_time = in.input.scans().intervals.count() > 0 && in.input.scans().Apart(in.input.images()) == 0.0;
  if (!in_time || !in.has_laser || !in.laser_is_matched || in.map == nullptr || !in.map->metric) return;
  long links = 0;
  for (const auto& [id, keyframe] : in.map->keyframes) links += static_cast<long>(keyframe.laser_links.size());
  if (static_cast<long>(in.map->keyframes.size()) < kFewestKeyframes || links > 0) return;
  found->push_back({Harm::kBent, "laser",
                    "the laser never agrees with the motion: its mount in tf (upside down?) or its ranges "
                    "look wrong, or it sees no walls"});
}

void AddUnused(const FindingsInput& in, Found* found) {
  const double images = static_cast<double>(in.input.images().intervals.count()) + 1.0;
  for (const auto& [reason, count] : in.unused) {
    const bool placeholder = reason.find("placeholder") != std::string::npos;
    if (placeholder) {
      found->push_back({Harm::kMissing, "input",
                        "the odometry's covariances are placeholders, the same whatever the robot does: "
                        "not believed; odometry_noise describes the wheels instead"});
    } else if (static_cast<double>(count) > kUnusedShare * images) {
      found->push_back({Harm::kMissing, "input", fmt::format("unused: {} x {}", count, reason)});
    }
  }
}

}  // namespace

bool HardlyMapped(const EstimatorReport& report, const Map* map) {
  constexpr double kMost = 0.8;  // of the frames, still without a pose
  double frames = 0.0, waiting = 0.0;
  for (const auto& [state, count] : report.frames) {
    frames += static_cast<double>(count);
    waiting += state == TrackingState::kInitializing ? static_cast<double>(count) : 0.0;
  }
  return map == nullptr || (frames > 0.0 && waiting > kMost * frames);
}

std::vector<Finding> FindAll(const FindingsInput& input) {
  Found found;
  AddClocks(input, &found);
  AddLaserClock(input, &found);
  AddMount(input, &found);
  AddNoMap(input, &found);
  AddWheels(input, &found);
  AddScale(input, AddHeight(input, &found), &found);
  AddLaser(input, &found);
  AddStreams(input, &found);
  AddShutter(input, &found);
  AddEnds(input, &found);
  AddUnused(input, &found);
  AddYaw(input, &found);
  std::stable_sort(found.begin(), found.end(), [](const Finding& a, const Finding& b) { return a.harm > b.harm; });
  return found;
}

std::vector<std::string> Findings(const FindingsInput& input) {
  std::vector<std::string> lines;
  for (Finding& finding : FindAll(input)) lines.push_back(std::move(finding.text));
  lines.insert(lines.end(), input.notes.begin(), input.notes.end());
  if (lines.size() > kMostFindings) lines.resize(kMostFindings);
  return lines;
}

}  // namespace planar_vslam
