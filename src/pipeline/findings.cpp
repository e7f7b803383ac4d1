#include "planar_vslam/pipeline/findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "planar_vslam/pipeline/wheel_check.h"

namespace planar_vslam {
namespace {

using Found = std::vector<Finding>;

// Limits beyond what drives with good sensors show (chosen by looking at simulated and recorded ones).
constexpr double kRejectedShare = 0.1;  // of frames with odometry, on which the view contradicts the wheels
constexpr double kSomeRejected = 0.02;  // the same, where something else is wrong, too
constexpr double kOffFloorShare = 0.5;  // of keyframes; ramps and sills take fewer
constexpr double kScaleSigmas = 4.0;    // between two sources of scale ...
constexpr double kScaleShare = 0.015;   // ... and at least so much
constexpr double kTurnShare = 0.03;     // that wheels turn too far ...
constexpr double kDirection = 1.2;      // deg that wheels drive askew ...
constexpr double kSigmas = 5.0;         // ... and each so many standard deviations
constexpr double kClockSigmas = 3.0;
constexpr double kFrameSigmas = 3.0;   // of a direction by all frames
constexpr double kFastest = 40.0;      // m/s, of a car
constexpr double kIrregular = 1.6;     // mean over usual interval between images
constexpr double kUnusedShare = 0.2;   // of a stream's messages
constexpr long kFewestKeyframes = 10;  // that say something

// Whether a camera seems to be mounted in the axes of a body, x forward and z up: it would look at the ceiling.
bool LooksLikeABodyFrame(const Rigid3& T_base_camera) {
  // z up and x forward, where an optical axis should point forward: within 25 degrees each.
  constexpr double kAligned = 0.9;
  const Eigen::Matrix3d R = T_base_camera.R();
  return R(2, 2) > kAligned && R(0, 0) > kAligned;
}

// Share of the keyframes that stand off the floor.
double OffFloor(const Map* map) {
  if (map == nullptr || static_cast<long>(map->keyframes.size()) < kFewestKeyframes) return 0.0;
  double off = 0.0;
  for (const auto& [id, keyframe] : map->keyframes) off += keyframe.on_floor ? 0.0 : 1.0;
  return off / static_cast<double>(map->keyframes.size());
}

long FramesIn(const EstimatorReport& report, TrackingState state) {
  const auto count = report.frames.find(state);
  return count == report.frames.end() ? 0 : count->second;
}

// Whether the wheels gave most of the poses.
bool IsBlind(const EstimatorReport& report) {
  constexpr double kMost = 0.5;
  const long blind = FramesIn(report, TrackingState::kOdometry);
  const long by_sight = FramesIn(report, TrackingState::kTracking) + FramesIn(report, TrackingState::kRelocalized);
  return blind > kFewestKeyframes && static_cast<double>(blind) > kMost * static_cast<double>(blind + by_sight);
}

void AddMount(const FindingsInput& in, Found* found) {
  const long steps = in.report.odometry_by_model + in.report.odometry_by_messages;
  const double rejected =
      steps > 0 ? static_cast<double>(in.report.odometry_rejected) / static_cast<double>(steps) : 0.0;
  const bool many_rejected = rejected > kRejectedShare && in.report.odometry_rejected > kFewestKeyframes;
  // Beyond a ramp the robot is off the floor of its first keyframe for good, and its wheels go on agreeing.
  const double off_floor = OffFloor(in.map);
  const bool floor_left = in.has_base && off_floor > kOffFloorShare && (rejected > kSomeRejected || IsBlind(in.report));
  const auto& mount = in.input.T_base_camera();
  const bool body = in.has_base && mount.has_value() && LooksLikeABodyFrame(*mount);
  if (body && (many_rejected || floor_left || IsBlind(in.report) || in.map == nullptr)) {
    found->push_back({Harm::kWorthless, "mount",
                      "the images' frame looks like a body frame (x forward, z up), not an optical one (z forward, y "
                      "down): the camera seems to look at the ceiling; set the driver's optical frame id, or its tf"});
  }
  if (many_rejected) {
    found->push_back({Harm::kWorthless, "mount",
                      fmt::format("{} of {} steps of the wheels contradict the images: wheels that slip or read wrong, "
                                  "or a wrong mount or calibration of the camera; check tf and camera_info",
                                  in.report.odometry_rejected, steps)});
  }
  if (floor_left) {
    found->push_back(
        {Harm::kWorthless, "mount",
         fmt::format("{:.0f} % of the keyframes stand off the floor: height or tilt of the camera in tf is wrong, "
                     "or the floor is not flat (then --set planar.mode=off)",
                     100.0 * off_floor)});
  }
}

// Whether most images have no odometry around them.
bool ClocksDiffer(const FindingsInput& in) {
  const auto uncovered = in.unused.find("image waited for odometry in vain");
  constexpr double kMany = 0.5;
  return in.input.odometry().Apart(in.input.images()) != 0.0 ||
         (uncovered != in.unused.end() &&
          static_cast<double>(uncovered->second) > kMany * static_cast<double>(in.input.images().intervals.count()));
}

void AddNoMap(const FindingsInput& in, Found* found) {
  constexpr double kDriven = 1.0;  // m
  if (!HardlyMapped(in.report, in.map)) return;
  if (ClocksDiffer(in)) return;    // told by that
  constexpr double kStood = 0.02;  // m
  if (in.input.odometry().intervals.count() > 0 && in.map == nullptr && in.input.wheel_way() < kStood) {
    found->push_back({Harm::kWorthless, "odometry",
                      "no map came about: odometry never moved. If the robot did, its wheels report nothing; --set "
                      "init=visual does without them"});
    return;
  }
  if (in.input.wheel_way() < kDriven) return;
  found->push_back(
      {Harm::kWorthless, "odometry",
       fmt::format(
           "no map {}, although the wheels drove {:.1f} m: odometry may run backwards, or the camera's mount or "
           "calibration be wrong; --set init=visual does without them",
           in.map == nullptr ? "came about" : "lasted", in.input.wheel_way())});
}

// Links between keyframes tell of few, steps between frames of many, and more exactly.
void AddDirection(const WheelCheck& links, const MotionAgreement& frames, Found* found) {
  constexpr double kBackwards = 90.0, kFrameDirection = 0.4;  // deg
  const auto& direction = frames.direction.has_value() ? frames.direction : links.direction;
  if (!direction.has_value()) return;
  const double degrees = RadiansToDegrees(direction->value);
  const double least = frames.direction.has_value() ? kFrameDirection : kDirection;
  const double sigmas = frames.direction.has_value() ? kFrameSigmas : kSigmas;
  if (std::abs(degrees) > kBackwards) {
    found->push_back({Harm::kWorthless, "odometry",
                      "the wheels drive backwards where the images go forwards: the sign of the odometry or the "
                      "direction of the camera in tf is wrong"});
  } else if (std::abs(degrees) > least && std::abs(direction->value) > sigmas * direction->sigma) {
    found->push_back({Harm::kBent, "mount",
                      fmt::format("the wheels drive {:.1f} deg {} of where the images do, although the map leans "
                                  "towards the wheels: the yaw of the camera in tf looks wrong; run `planar_vslam "
                                  "calibrate`",
                                  std::abs(degrees), degrees > 0.0 ? "left" : "right")});
  }
}

void AddWheels(const FindingsInput& in, Found* found) {
  const double speed = in.input.wheel_speed();
  if (speed > kFastest) {
    found->push_back({Harm::kWorthless, "odometry",
                      fmt::format("the wheels drive at {:.0f} m/s: odometry is not in metres (as in "
                                  "millimetres?); correct its publisher",
                                  speed)});
  }
  constexpr double kOften = 0.05;
  if (in.input.odometry_back_and_forth() > kOften) {
    found->push_back({Harm::kBent, "odometry",
                      fmt::format("{:.0f} % of odometry's steps take back the one before, faster than a robot can: two "
                                  "sources on one topic (or tf)? Stop one of them",
                                  100.0 * in.input.odometry_back_and_forth())});
  }
  if (in.map == nullptr || static_cast<long>(in.map->keyframes.size()) < kFewestKeyframes) return;
  const WheelCheck check = CheckWheels(*in.map);
  AddDirection(check, in.motion, found);
  if (!check.turn.has_value()) return;
  const double turn = check.turn->value - in.report.wheels.log_turn;  // the map's links are corrected by that
  if (std::abs(turn) > kTurnShare && std::abs(turn) > kSigmas * check.turn->sigma) {
    found->push_back({Harm::kBent, "odometry",
                      fmt::format("the wheels turn {:.1f} % too {}; run `planar_vslam calibrate`",
                                  100.0 * std::abs(turn), turn > 0.0 ? "far" : "little")});
  }
}

void AddClocks(const FindingsInput& in, Found* found) {
  constexpr const char* kCure =
      "the clocks of two computers differ, or a driver stamps wrongly; synchronise them (chrony)";
  const std::pair<const char*, const StreamRhythm*> streams[] = {{"odometry", &in.input.odometry()},
                                                                 {"the laser", &in.input.scans()}};
  bool odometry_told = false;
  for (const auto& [name, stream] : streams) {
    const double apart = stream->Apart(in.input.images());
    if (apart == 0.0) continue;
    odometry_told = odometry_told || stream == &in.input.odometry();
    found->push_back({Harm::kWorthless, "clocks",
                      fmt::format("all stamps of {} lie {:.1f} s or more {} those of the images: {}", name,
                                  std::abs(apart), apart > 0.0 ? "after" : "before", kCure)});
  }
  if (ClocksDiffer(in) && !odometry_told) {
    found->push_back(
        {Harm::kWorthless, "clocks",
         fmt::format("odometry has no readings around the stamps of most images: it stopped, or {}", kCure)});
  }
  constexpr double kLeast = 0.03;  // s: as much as a loaded computer delays a stamp by
  const auto& offset = in.motion.time_offset;
  if (!offset.has_value() || std::abs(offset->value) < kLeast + kClockSigmas * offset->sigma) return;
  found->push_back({Harm::kBent, "clocks",
                    fmt::format("odometry's stamps are {:.0f} ms {} than the images'; run `planar_vslam calibrate`",
                                1e3 * std::abs(offset->value), offset->value > 0.0 ? "later" : "earlier")});
}

struct ScaleSource {
  const char* name;
  const char* cure;
  ScaleMeasurement says;
  double sigma;  // of what it says in this drive
};

// The two that disagree most.
void AddScale(const FindingsInput& in, Found* found) {
  if (in.map == nullptr || !in.map->metric) return;
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
  if (scale.floor.has_value() && OffFloor(in.map) < kMostlyOnFloor) {
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
  found->push_back(
      {Harm::kBent, "scale",
       fmt::format("scale: by {} everything is {:.1f} % {} than by {}, which is believed; {}", worst->name,
                   100.0 * std::abs(share), share > 0.0 ? "larger" : "smaller", sources[0].name, worst->cure)});
}

void AddStreams(const FindingsInput& in, Found* found) {
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

void AddLaser(const FindingsInput& in, Found* found) {
  if (in.has_laser && in.input.laser().IsUpsideDown()) {
    found->push_back({Harm::kWorthless, "laser",
                      "the sweeps turn the other way than the wheels: the laser hangs upside down against its mount in "
                      "tf; correct the roll of its frame"});
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
  AddMount(input, &found);
  AddNoMap(input, &found);
  AddWheels(input, &found);
  AddClocks(input, &found);
  AddScale(input, &found);
  AddLaser(input, &found);
  AddStreams(input, &found);
  AddUnused(input, &found);
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
