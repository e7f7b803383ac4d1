#include "planar_vslam/pipeline/estimator.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "estimator_session.h"
#include "planar_vslam/geometry/tangent_parts.h"
#include "planar_vslam/pipeline/mapper_context.h"

namespace planar_vslam {
namespace {

constexpr int kRetiringNiceness = 10;  // nobody waits for it

// Without odometry only the images themselves can start a map.
PipelineOptions UsableOptions(PipelineOptions options, bool with_odometry) {
  if (!with_odometry) options.initializer.mode = InitializationMode::kVisual;
  return options;
}

EstimatorSettings UsableSettings(EstimatorSettings settings) {
  settings.options = UsableOptions(std::move(settings.options), settings.with_odometry);
  return settings;
}

// m from the nearest keyframe; infinite where there is none.
double DistanceToMap(const Map& map, const Rigid3& T_map_base) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& [id, keyframe] : map.keyframes) {
    nearest = std::min(nearest, (keyframe.T_map_base.translation - T_map_base.translation).norm());
  }
  return nearest;
}

}  // namespace

Estimator::Input::Input(const EstimatorSettings& settings)
    : corrector(settings.options.calibration),
      clock(settings.options.image_timing),
      synchronizer(settings.with_odometry) {
  synchronizer.SetImageOffset(clock.offset());
}

Estimator::Estimator(const EstimatorSettings& settings)
    : settings_(UsableSettings(settings)),
      model_(MeasurementModelOf(settings_.options, settings_.camera, settings_.has_base)),
      mode_(settings.options.mode),
      map_camera_(settings.camera),
      retiring_(MakeExecutor(settings.schedule, kRetiringNiceness)) {
  Restart();
}

Estimator::~Estimator() = default;

std::vector<FrameReport> Estimator::Add(CameraFrame frame) {
  input_->watch.Add(frame);
  input_->synchronizer.Push(input_->corrector.Correct(std::move(frame)));
  return Drain();
}

std::vector<FrameReport> Estimator::Add(const OdometryReading& reading) {
  input_->watch.Add(reading);
  if (settings_.with_odometry) input_->wheels.Push({input_->corrector.Correct(reading.stamp), reading.T_odom_base});
  if (const std::optional<OdometryReading> continued = input_->continuity.Push(reading)) {
    input_->synchronizer.Push(input_->corrector.Correct(*continued));
  }
  if (input_->continuity.TakeWorthlessStart() && map() == nullptr) StartSession(nullptr);
  return Drain();
}

std::vector<FrameReport> Estimator::Add(LaserFrame frame) {
  if (input_->watch.Add(frame)) input_->synchronizer.Push(input_->corrector.Correct(std::move(frame)));
  return Drain();
}

std::vector<FrameReport> Estimator::Flush() {
  input_->synchronizer.Finish();
  return Drain();
}

std::vector<FrameReport> Estimator::Drain() {
  std::vector<FrameReport> reports;
  while (const std::optional<FramePacket> packet = input_->synchronizer.Pop()) reports.push_back(Process(*packet));
  return reports;
}

FrameReport Estimator::Process(const FramePacket& packet) {
  const Stopwatch total;
  Session& session = *session_;
  FrameReport report;
  report.stamp = packet.image.stamp;
  report.T_base_exposed = packet.T_base_exposed;
  FollowMap(false, &report.times);
  std::shared_ptr<const Map> new_map;
  const KeyframeSlot slot = session.mapping != nullptr ? session.mapping->slot() : KeyframeSlot::kNone;
  const bool may_make_map = mode_ == RunMode::kMapping;
  TrackedFrame frame = session.localization->Locate(packet, slot, &report, may_make_map ? &new_map : nullptr);
  std::optional<Rigid3> T_known_base;
  if (session.known != nullptr) T_known_base = session.known->Locate(packet, frame.features, &report.times);
  if (std::exchange(session.joined, false)) {
    report.joined = true;
    if (report.T_map_base.has_value()) report.state = TrackingState::kRelocalized;
  }
  session.seen = session.seen || (session.localization->map() != nullptr && report.inliers > 0);
  if (session.seen && session.own != nullptr) EndOn(retiring_.get(), std::move(session.own));
  if (session.known == nullptr && MayMapOnItsOwn()) StartOwnMap(packet, &frame, &report, &new_map);
  WatchClock(packet, frame);
  session.Count(report, frame.step);
  view_ = ViewOf(packet.image.image, frame.features, frame.track, packet.T_base_camera, model_.camera,
                 session.localization->map().get());
  if (new_map != nullptr) {
    StartMapping(new_map, frame.step.has_value());
    session.mapping->AddSweeps(packet, *frame.number);
    session.report.keyframes_made = static_cast<long>(new_map->keyframes.size());
  } else if (session.mapping != nullptr) {
    if (T_known_base.has_value() && frame.track.wants_keyframe) session.mapping->Meet({report.stamp, *T_known_base});
    if (!report.metric && report.waiting_for.empty()) report.waiting_for = session.mapping->scale_missing();
    report.keyframe = session.mapping->Add(packet, std::move(frame), session.localization->trajectory());
    FollowMap(false, &report.times);
  }
  const std::optional<Rigid2> T_odom_base = input_->wheels.Interpolate(report.stamp);
  if (report.T_map_base.has_value() && report.metric && T_odom_base.has_value()) {
    report.T_map_odom = ProjectToPlane(*report.T_map_base) * T_odom_base->Inverse();
  }
  input_->wheels.DropBefore(report.stamp);
  report.total_ms = total.Milliseconds();
  report.times.push_back({"frame.total", report.total_ms});
  session.report.stages.Add(report.times);
  return report;
}

// Learns when images are taken from frames whose view told their heading.
void Estimator::WatchClock(const FramePacket& packet, const TrackedFrame& frame) {
  constexpr int kFewest = 30;  // inliers, for a heading that does not hang on the wheels'
  std::optional<Rigid2> T_map_base;
  if (frame.by_view_alone && frame.track.inliers >= kFewest) T_map_base = ProjectToPlane(frame.track.T_map_base);
  input_->clock.Watch(packet, T_map_base);
  if (frame.track.jumped) input_->clock.Forget();
  input_->synchronizer.SetImageOffset(input_->clock.offset());
  session_->report.image_offset = input_->clock.learned();
  constexpr double kWorth = 3e-3;  // s, a fifth of a degree in a fast turn
  if (session_->mapping != nullptr && input_->clock.certain()) {
    session_->mapping->FollowImageOffset(input_->clock.offset().value, kWorth);
  }
}

// Passes the changes of the map on to localization and report.
void Estimator::FollowMap(bool wait, StageTimes* times) {
  if (session_->mapping == nullptr) return;
  const Stopwatch following;
  const std::vector<MapChange> changes = session_->mapping->Collect(wait);
  for (const MapChange& change : changes) {
    session_->localization->Follow(change);
    session_->Count(change, settings_.options.scale.max_sigma);
    if (change.joined.has_value()) EndOn(retiring_.get(), std::move(session_->known));
    if (change.wheels.has_value()) input_->corrector.Take(*change.wheels);
    if (change.loop.has_value() || change.joined.has_value() || change.image_offset.has_value()) input_->clock.Forget();
    times->insert(times->end(), change.times.begin(), change.times.end());
  }
  if (!changes.empty()) times->push_back({"frame.follow_map", following.Milliseconds()});
}

void Estimator::WaitForMap() {
  StageTimes times;
  FollowMap(true, &times);
  session_->report.stages.Add(times);
}

Expected<bool> Estimator::Finish() {
  constexpr double kWorth = 1e-3;  // s
  const bool adjust = settings_.options.final_bundle_adjustment;
  if (session_->mapping != nullptr && adjust) {
    session_->mapping->FollowImageOffset(input_->clock.offset().value, kWorth);
  }
  WaitForMap();
  if (session_->mapping == nullptr) return true;
  Expected<MapChange> finished = session_->mapping->Finish(session_->localization->trajectory(), adjust);
  if (!finished.ok()) {
    FollowSweeps();
    return finished.error();
  }
  session_->localization->Follow(*finished);
  session_->Count(*finished, settings_.options.scale.max_sigma);
  session_->report.stages.Add(finished->times);
  return true;
}

// The last sweeps are in the map: no job put them there.
void Estimator::FollowSweeps() {
  MapChange change;
  change.map = session_->mapping->map();
  session_->localization->Follow(change);
}

void Estimator::StartSession(std::shared_ptr<const Map> map) {
  // Its jobs cannot be stopped, and nobody has to wait for them.
  if (session_ != nullptr) EndOn(retiring_.get(), std::move(session_));
  session_ = std::make_unique<Session>(settings_, model_);
  view_ = {};
  input_->clock.Forget();
  session_->report.wheels = UnknownWheelErrors(settings_.options.systematic);
  input_->corrector.Take(session_->report.wheels);
  if (map == nullptr) return;
  session_->localization->StartIn(map);
  if (mode_ == RunMode::kMapping) StartMapping(std::move(map), false);
}

void Estimator::StartMapping(std::shared_ptr<const Map> map, bool may_link) {
  const MapJobsContext context{MapperContextOf(settings_.options, model_), settings_.options.scale};
  session_->mapping =
      std::make_unique<Mapping>(context, std::move(map), settings_.schedule, may_link, session_->report.wheels,
                                session_->known != nullptr ? session_->known->map() : nullptr);
  session_->mapping->StartWithImageOffset(input_->clock.offset().value);
}

bool Estimator::MayMapOnItsOwn() const {
  return mode_ == RunMode::kMapping && map() != nullptr && loaded_map_ != nullptr && map()->metric && !session_->seen &&
         session_->distance > KnownMap::kPatience;
}

void Estimator::StartOwnMap(const FramePacket& packet, TrackedFrame* frame, FrameReport* report,
                            std::shared_ptr<const Map>* new_map) {
  Session& session = *session_;
  if (session.own == nullptr) {
    session.own =
        std::make_unique<Localization>(settings_.options, model_, settings_.schedule, settings_.trajectory_frames);
  }
  session.own->NumberAbove(map());
  session.own->ExpectAt(report->T_map_base);
  FrameReport by_own_map;
  by_own_map.stamp = report->stamp;
  TrackedFrame own_frame = session.own->Locate(packet, KeyframeSlot::kNone, &by_own_map, new_map);
  if (*new_map == nullptr) return;
  input_->clock.Forget();
  if (session.mapping != nullptr) EndOn(retiring_.get(), std::move(session.mapping));
  session.known = std::make_unique<KnownMap>(std::exchange(session.localization, std::move(session.own)));
  session.report.own_map = true;
  *frame = std::move(own_frame);
  *report = std::move(by_own_map);
}

void Estimator::Restart() {
  input_ = std::make_unique<Input>(settings_);
  StartSession(loaded_map_);
}

// Old and new keyframes of a map that grows are adjusted with one camera.
Expected<bool> Estimator::MayGrow(const CameraModel& camera) const {
  if (IsSameCamera(camera, settings_.camera)) return true;
  return Error{"made with another camera; expected this one's, or mode localization"};
}

Expected<bool> Estimator::LoadMap(const SavedMap& saved) {
  std::vector<std::string> problems;
  if (saved.map.keyframes.empty()) problems.emplace_back("expected a map with keyframes");
  if (saved.map.octave_scales != settings_.options.orb.ScaleFactors()) {
    problems.emplace_back("made with other orb.scale_factor or orb.level_count; expected those of the configuration");
  }
  const Expected<bool> may_grow = MayGrow(saved.camera);
  if (mode_ == RunMode::kMapping && !may_grow.ok()) problems.push_back(may_grow.error().message);
  if (!problems.empty()) return Error{fmt::format("{}", fmt::join(problems, "; "))};
  loaded_map_ = std::make_shared<const Map>(saved.map);
  map_camera_ = saved.camera;
  StartSession(loaded_map_);
  return true;
}

Expected<bool> Estimator::SetMode(RunMode mode) {
  if (mode == mode_) return true;
  if (mode == RunMode::kLocalization) {
    if (map() == nullptr) return Error{"mode localization: expected a map to localize in, but there is none yet"};
    WaitForMap();
    if (session_->mapping != nullptr) {
      (void)session_->mapping->Finish(session_->localization->trajectory(), false);
      FollowSweeps();
    }
    session_->mapping.reset();
    if (session_->own != nullptr) EndOn(retiring_.get(), std::move(session_->own));
    const bool beside_known = session_->known != nullptr;
    if (beside_known) EndOn(retiring_.get(), std::move(session_->known));  // two maps that stay two
    session_->localization->UseSweeps();
    if (!beside_known) loaded_map_ = map();  // a restart starts in it again
  } else {
    const Expected<bool> may_grow = MayGrow(map_camera_);
    if (map() != nullptr && !may_grow.ok()) return Error{"mode mapping: the map was " + may_grow.error().message};
    if (map() != nullptr) StartMapping(map(), false);
  }
  mode_ = mode;
  return true;
}

Expected<bool> Estimator::StartAt(const Rigid3& T_map_base, const Matrix6d& covariance) {
  constexpr double kFarthest = 10.0;  // m from the nearest keyframe: nothing of the map is in view beyond
  if (map() == nullptr) return Error{"pose: expected a map to stand in, but there is none yet"};
  if (!map()->metric) return Error{"pose: expected a map in metres, but its scale is not known yet"};
  constexpr double kTiny = 1e-12;  // height and tilt may be known exactly
  const Matrix6d regular = 0.5 * (covariance + covariance.transpose()) + kTiny * Matrix6d::Identity();
  if (!T_map_base.translation.allFinite() || !covariance.allFinite() ||
      Eigen::LLT<Eigen::Matrix3d>(covariance(kPlanarRows, kPlanarRows)).info() != Eigen::Success ||
      Eigen::LLT<Matrix6d>(regular).info() != Eigen::Success) {
    return Error{"pose: expected finite numbers, and a covariance that is positive definite in x, y and yaw"};
  }
  const double distance = DistanceToMap(*map(), T_map_base);
  if (distance > kFarthest) {
    return Error{fmt::format("pose: {:.1f} m from the nearest keyframe; expected one in the map, at most {:.0f} m away",
                             distance, kFarthest)};
  }
  session_->localization->StartAt(T_map_base, covariance);
  input_->clock.Forget();
  if (session_->mapping != nullptr) session_->mapping->BreakMotion();
  return true;
}

Expected<bool> Estimator::AdjustMap() {
  if (map() == nullptr) return Error{"expected a map to adjust, but there is none yet"};
  if (session_->mapping == nullptr) return Error{"the map stays as it is in mode localization; expected mode mapping"};
  session_->mapping->AdjustWholeMap();
  return true;
}

std::map<std::string, long> Estimator::unused_input() const {
  std::map<std::string, long> all = input_->synchronizer.dropped();
  for (const auto& [reason, count] : input_->continuity.counted()) all[reason] += count;
  return all;
}

std::shared_ptr<const Map> Estimator::map() const { return session_->localization->map(); }
const EstimatorReport& Estimator::report() const { return session_->report; }
const TrajectoryRecorder& Estimator::trajectory() const { return session_->localization->trajectory(); }

std::optional<EstimatorSnapshot> Estimator::Snapshot() const {
  if (map() == nullptr) return std::nullopt;
  return EstimatorSnapshot{map(), trajectory(), map_camera_, session_->last_frame};
}

}  // namespace planar_vslam
