#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "findings_parts.h"
#include "planar_vslam/pipeline/wheel_check.h"

namespace planar_vslam {
namespace {

// Limits beyond what drives with good sensors show (chosen by looking at simulated and recorded ones).
constexpr double kRejectedShare = 0.1;  // of frames with odometry, on which the view contradicts the wheels
constexpr double kSomeRejected = 0.02;  // the same, where something else is wrong, too
constexpr double kOffFloorShare = 0.5;  // of keyframes; ramps and sills take fewer
constexpr double kTurnShare = 0.04;     // that wheels turn too far: usual ones do by 3 % ...
constexpr double kDirection = 1.2;      // deg that wheels drive askew ...
constexpr double kSigmas = 5.0;         // ... and each so many standard deviations
constexpr double kClockSigmas = 3.0;
constexpr double kLeastClock = 0.03;  // s: as much as a loaded computer delays a stamp by
constexpr double kFrameSigmas = 3.0;  // of a direction by all frames
constexpr double kFastest = 40.0;     // m/s, of a car ...
constexpr double kSideways = 12.0;    // m/s^2, ... and in its bends: tyres hold no more

// Whether a camera seems to be mounted in the axes of a body, x forward and z up: it would look at the ceiling.
bool LooksLikeABodyFrame(const Rigid3& T_base_camera) {
  // z up and x forward, where an optical axis should point forward: within 25 degrees each.
  constexpr double kAligned = 0.9;
  const Eigen::Matrix3d R = T_base_camera.R();
  return R(2, 2) > kAligned && R(0, 0) > kAligned;
}

// Whether most images have no odometry around them.
bool ClocksDiffer(const FindingsInput& in) {
  const auto uncovered = in.unused.find("image waited for odometry in vain");
  constexpr double kMany = 0.5;
  return in.input.odometry().Apart(in.input.images()) != 0.0 ||
         (uncovered != in.unused.end() &&
          static_cast<double>(uncovered->second) > kMany * static_cast<double>(in.input.images().intervals.count()));
}

// By how much odometry's stamps are off, where that is told with certainty.
std::optional<double> ClockOffset(const FindingsInput& in) {
  const auto& offset = in.motion.time_offset;
  if (!offset.has_value() || std::abs(offset->value) < kLeastClock + kClockSigmas * offset->sigma) return std::nullopt;
  return offset->value;
}

// Whether by so much that wheels and images contradict each other because of it.
bool ClockIsFarOff(const FindingsInput& in) {
  constexpr double kFar = 0.15;  // s: 4 degrees at 0.5 rad/s
  return std::abs(ClockOffset(in).value_or(0.0)) > kFar;
}

double UsualInterval(const StreamRhythm& stream) { return stream.intervals.Percentile(0.5); }  // ms

bool OdometryIsSeldom(const FindingsInput& in) {
  constexpr double kSeldom = 400.0;  // ms: a robot begins and ends a turn in less
  return UsualInterval(in.input.odometry()) > kSeldom;
}

// Links between keyframes tell of few, steps between frames of many, and more exactly.
void AddDirection(const WheelCheck& links, const FindingsInput& in, Found* found) {
  constexpr double kBackwards = 90.0, kFrameDirection = 0.4;  // deg
  const MotionAgreement& frames = in.motion;
  const auto& direction = frames.direction.has_value() ? frames.direction : links.direction;
  if (!direction.has_value()) return;
  const double degrees = RadiansToDegrees(direction->value);
  const double least = frames.direction.has_value() ? kFrameDirection : kDirection;
  const double sigmas = frames.direction.has_value() ? kFrameSigmas : kSigmas;
  if (std::abs(degrees) > kBackwards) {
    found->push_back({Harm::kWorthless, "odometry",
                      "the wheels drive backwards where the images go forwards: the sign of the odometry or the "
                      "direction of the camera in tf is wrong"});
  } else if (!in.yaw.has_value() && std::abs(degrees) > least &&
             std::abs(direction->value) > sigmas * direction->sigma) {
    found->push_back(
        {Harm::kBent, "mount",
         fmt::format("the wheels drive {:.1f} deg {} of where the images do, although the map leans "
                     "towards the wheels: the yaw of the camera {}in tf looks wrong; run `planar_vslam calibrate`",
                     std::abs(degrees), degrees > 0.0 ? "left" : "right", in.has_laser ? "(or of the laser) " : "")});
  }
}

}  // namespace

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
  constexpr double kFarthest = 10.0;  // m, from the base
  if (in.has_base && in.input.T_base_camera().has_value()) {
    const Eigen::Vector3d& place = in.input.T_base_camera()->translation;
    if (place.norm() > kFarthest) {
      found->push_back({Harm::kWorthless, "mount",
                        fmt::format("the camera is {:.0f} m from the base in tf, which is not in metres (as in "
                                    "millimetres?); correct it",
                                    place.norm())});
      return;
    }
    if (place.z() <= 0.0) {
      found->push_back({Harm::kMissing, "mount",
                        fmt::format("the camera is {:.2f} m above the base frame, which should lie on the floor: "
                                    "heights in the grid will be wrong; correct its height in tf",
                                    place.z())});
    }
  }
  const long steps = in.report.odometry_by_model + in.report.odometry_by_messages;
  const double rejected =
      steps > 0 ? static_cast<double>(in.report.odometry_rejected) / static_cast<double>(steps) : 0.0;
  const bool many_rejected = rejected > kRejectedShare && in.report.odometry_rejected > kFewestKeyframes;
  // Beyond a ramp the robot is off the floor of its first keyframe for good, and its wheels go on agreeing.
  const double off_floor = OffFloor(in.map);
  const bool floor_left = in.has_base && !ClockIsFarOff(in) && off_floor > kOffFloorShare &&
                          (rejected > kSomeRejected || IsBlind(in.report));
  const auto& mount = in.input.T_base_camera();
  const bool body = in.has_base && mount.has_value() && LooksLikeABodyFrame(*mount);
  if (body && (many_rejected || floor_left || IsBlind(in.report) || in.map == nullptr)) {
    found->push_back({Harm::kWorthless, "mount",
                      "the images' frame looks like a body frame (x forward, z up), not an optical one (z forward, y "
                      "down): the camera seems to look at the ceiling; set the driver's optical frame id, or its tf"});
  }
  if (many_rejected && OdometryIsSeldom(in)) {
    found->push_back(
        {Harm::kBent, "odometry",
         fmt::format("{} of {} steps of the wheels contradict the images: odometry comes only {:.1f} times "
                     "a second, and what the wheels do in between is guessed; publish it at 10 Hz or more",
                     in.report.odometry_rejected, steps, 1e3 / UsualInterval(in.input.odometry()))});
  } else if (many_rejected && !ClockIsFarOff(in)) {
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

void AddNoMap(const FindingsInput& in, Found* found) {
  constexpr double kDriven = 1.0;  // m
  if (!HardlyMapped(in.report, in.map)) return;
  const char* outcome = in.map == nullptr ? "came about" : "lasted";
  if (in.starts_by_images) {
    if (in.input.wheel_way() < kDriven) return;
    found->push_back({Harm::kWorthless, "images",
                      fmt::format("no map {}, although the robot drove {:.1f} m: the images show too little, or the "
                                  "camera's calibration is wrong; check camera_info",
                                  outcome, in.input.wheel_way())});
    return;
  }
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
           outcome, in.input.wheel_way())});
}

void AddWheels(const FindingsInput& in, Found* found) {
  const double speed = in.input.wheel_speed();
  if (speed > kFastest || in.input.wheel_sideways() > kSideways) {
    found->push_back(
        {Harm::kWorthless, "odometry",
         fmt::format("the wheels drive at {:.0f} m/s, with {:.0f} m/s^2 in bends: odometry is not in metres "
                     "(as in centimetres or millimetres?); correct its publisher",
                     speed, in.input.wheel_sideways())});
  }
  constexpr double kOften = 0.05;
  if (in.input.odometry_back_and_forth() > kOften) {
    found->push_back({Harm::kBent, "odometry",
                      fmt::format("{:.0f} % of odometry's steps take back the one before, faster than a robot can: two "
                                  "sources on one topic (or tf)? Stop one of them",
                                  100.0 * in.input.odometry_back_and_forth())});
  }
  if (in.map == nullptr || static_cast<long>(in.map->keyframes.size()) < kFewestKeyframes) return;
  if (ClockIsFarOff(in)) return;  // told by that
  const WheelCheck check = CheckWheels(*in.map);
  AddDirection(check, in, found);
  if (!check.turn.has_value()) return;
  const double turn = check.turn->value - in.report.wheels.log_turn;  // the map's links are corrected by that
  constexpr double kNone = 0.9;                                       // of the turns, missing
  if (turn < -kNone && turn > -2.0 + kNone) {
    found->push_back({Harm::kWorthless, "odometry",
                      "the wheels never turn where the images do: the orientation of odometry is not filled in; "
                      "correct its publisher"});
    return;
  }
  if (std::abs(turn) > kTurnShare && std::abs(turn) > kSigmas * check.turn->sigma) {
    found->push_back(
        {Harm::kBent, "odometry",
         fmt::format("the wheels turn {:.1f} % too {} (or the focal length in camera_info is as much too "
                     "{}); run `planar_vslam calibrate`",
                     100.0 * std::abs(turn), turn > 0.0 ? "far" : "little", turn > 0.0 ? "long" : "short")});
  }
}

void AddYaw(const FindingsInput& in, Found* found) {
  constexpr double kLeast = 0.6;  // deg
  const bool bent = std::any_of(found->begin(), found->end(), [](const Finding& finding) {
    const std::string subject = finding.subject;
    return finding.harm == Harm::kWorthless && (subject == "laser" || subject == "clocks");
  });
  if (!in.yaw.has_value() || bent) return;
  const double degrees = RadiansToDegrees(in.yaw->value), sigma = RadiansToDegrees(in.yaw->sigma);
  if (std::abs(degrees) < std::max(kLeast, kSigmas * sigma)) return;
  found->push_back({Harm::kBent, "mount",
                    fmt::format("the camera's yaw in tf is off by {:.1f} deg or more: it looks further to the {} than "
                                "said; run `planar_vslam calibrate`",
                                std::abs(degrees), degrees > 0.0 ? "left" : "right")});
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
  const std::optional<double> offset = ClockOffset(in);
  if (!offset.has_value()) return;
  const std::string cure = ClockIsFarOff(in)
                               ? fmt::format(
                                     "{}; for this recording, add {:.2f} to calibration.time_offset, then run "
                                     "`planar_vslam calibrate`",
                                     kCure, *offset)
                               : std::string("run `planar_vslam calibrate`");
  found->push_back({ClockIsFarOff(in) ? Harm::kWorthless : Harm::kBent, "clocks",
                    fmt::format("odometry's stamps are {:.0f} ms {} than the images'{} {}", 1e3 * std::abs(*offset),
                                *offset > 0.0 ? "later" : "earlier", ClockIsFarOff(in) ? ":" : ";", cure)});
}

void AddLaserClock(const FindingsInput& in, Found* found) {
  // A sweep is stamped when it begins, when it ends or in between, and what it shows is of its middle.
  const double least = 1e-3 * 0.5 * UsualInterval(in.input.scans()) + kLeastClock;
  const auto& offset = in.motion.laser_time_offset;
  if (!offset.has_value() || in.input.laser().IsUpsideDown()) return;
  if (std::abs(offset->value) < least + kClockSigmas * offset->sigma) return;
  if (std::abs(offset->value - ClockOffset(in).value_or(0.0)) < least) return;  // it is odometry that is off
  found->push_back(
      {Harm::kBent, "clocks",
       fmt::format("the laser's stamps are {:.0f} ms {} than odometry's: its driver stamps wrongly, or the "
                   "clocks of two computers differ; mend that",
                   1e3 * std::abs(offset->value), offset->value < 0.0 ? "later" : "earlier")});
}

}  // namespace planar_vslam
