#include "planar_vslam/pipeline/slam_system.h"

#include <algorithm>
#include <chrono>

namespace planar_vslam {
namespace {

class Stopwatch {
 public:
  double Milliseconds() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

MeasurementModel MakeMeasurementModel(const PipelineOptions& options, const CameraModel& camera,
                                      bool has_base_transform) {
  MeasurementModel context{camera, options.odometry_noise, options.planar, options.bundle};
  if (!has_base_transform) context.planar.mode = PlanarMode::kOff;  // nothing is known about a floor
  return context;
}

std::optional<PlanarMotion> Step(const FramePacket& packet, const OdometryNoise& noise) {
  if (packet.odometry.empty()) return std::nullopt;
  return Preintegrate(packet.odometry, noise);
}

// Features of the image, with twice the keypoints while there is no map: initialisation needs the matches.
FrameFeaturesPtr Extract(OrbExtractor* extractor, const FramePacket& packet, bool initializing, int count) {
  constexpr int kInitializationFactor = 2;
  return std::make_shared<const FrameFeatures>(
      extractor->Extract(packet.image.image, initializing ? kInitializationFactor * count : count));
}

}  // namespace

SlamSystem::SlamSystem(const PipelineOptions& options, const CameraModel& camera, bool has_base_transform,
                       Schedule schedule)
    : options_(options),
      camera_(camera),
      bundle_(MakeMeasurementModel(options, camera, has_base_transform)),
      extractor_(options.orb, camera),
      initializer_(options.initializer, bundle_, options.orb.ScaleFactors()),
      tracker_({camera, options.odometry_noise, bundle_.planar, options.tracker}) {
  if (schedule == Schedule::kThreaded) {
    executor_ = std::make_unique<WorkerExecutor>();
  } else {
    executor_ = std::make_unique<InlineExecutor>();
  }
}

SlamSystem::~SlamSystem() {
  if (pending_.has_value()) pending_->outcome.wait();
}

void SlamSystem::Reset() {
  if (pending_.has_value()) pending_->outcome.wait();
  pending_.reset();
  map_.reset();
  initializer_ = Initializer(options_.initializer, bundle_, options_.orb.ScaleFactors());
  tracker_ = Tracker({camera_, options_.odometry_noise, bundle_.planar, options_.tracker});
  since_keyframe_.reset();
  sightings_ = CountSightings{};
  trajectory_ = TrajectoryRecorder{};
  before_map_.clear();
  sweeps_ = SweepCollector{};
  report_ = SystemReport{};
  scale_gate_ = ScaleGate{};
  scale_missing_.clear();
  slipping_ = false;
  distance_ = 0.0;
  keyframe_covariance_.setZero();
  if (saved_map_ != nullptr) {
    map_ = saved_map_;
    tracker_.StartUnlocalized();
  }
}

std::vector<std::string> SlamSystem::StartFrom(const SavedMap& saved) {
  std::vector<std::string> problems;
  if (saved.map.keyframes.empty()) problems.emplace_back("expected a map with keyframes");
  if (saved.map.octave_scales != options_.orb.ScaleFactors()) {
    problems.emplace_back("made with other orb.scale_factor or orb.level_count; expected those of the configuration");
  }
  constexpr double kSameCamera = 0.5;  // px; a mapping run adjusts old and new keyframes with one camera
  const CameraModel& a = saved.camera;
  const CameraModel& b = camera_;
  const double difference =
      std::max({std::abs(a.fx - b.fx), std::abs(a.fy - b.fy), std::abs(a.cx - b.cx), std::abs(a.cy - b.cy)});
  if (!localizing() && (a.width != b.width || a.height != b.height || difference > kSameCamera)) {
    problems.emplace_back("made with another camera; expected this one's, or mode localization");
  }
  if (!problems.empty()) return problems;
  saved_map_ = std::make_shared<const Map>(saved.map);
  Reset();
  return problems;
}

FrameReport SlamSystem::Process(const FramePacket& packet) {
  const Stopwatch total;
  FrameReport report;
  report.stamp = packet.image.stamp;
  const FrameFeaturesPtr features = Extract(&extractor_, packet, map_ == nullptr, options_.orb.feature_count);
  report.extract_ms = total.Milliseconds();
  const std::optional<PlanarMotion> step = Step(packet, options_.odometry_noise);
  if (step.has_value()) distance_ += step->distance;
  if (step.has_value()) ++(step->modelled ? report_.odometry_by_model : report_.odometry_by_messages);
  if (map_ == nullptr) {
    Initialize(packet, features, step, &report);
  } else {
    TrackFrame(packet, features, step, &report);
  }
  report.total_ms = total.Milliseconds();
  ++report_.frames[report.state];
  return report;
}

void SlamSystem::Initialize(const FramePacket& packet, const FrameFeaturesPtr& features,
                            const std::optional<PlanarMotion>& step, FrameReport* report) {
  before_map_.push_back({packet.image.stamp, packet.T_base_camera, step});
  InitializerReport initial = initializer_.Add({packet.image.stamp, features, packet.T_base_camera, step});
  report->waiting_for = initial.waiting_for;
  if (!initial.map.has_value()) return;
  map_ = std::make_shared<const Map>(std::move(*initial.map));
  const auto& [id, keyframe] = *std::prev(map_->keyframes.end());
  tracker_.Start(*map_, id);
  if (step.has_value()) since_keyframe_ = PlanarMotion{};
  report_.initialized = packet.image.stamp;
  report_.keyframes_made = 2;
  PlaceEarlyFrames();
  report->state = TrackingState::kTracking;
  report->keyframe = true;
  report->T_map_base = keyframe.T_map_base;
  report->covariance =
      LiftedCovariance(keyframe.odometry_link.has_value() ? keyframe.odometry_link->motion : PlanarMotion{},
                       options_.odometry_noise) +
      CovarianceOfMapAt(keyframe.T_map_base);
  report->metric = map_->metric;
  report->inliers = static_cast<int>(map_->landmarks.size());
  T_map_base_last_ = keyframe.T_map_base;
  sweeps_.Add(packet, trajectory_.size() - 1);
}

// Frames from before the map hang on the first keyframe by odometry; on an unscaled map only the keyframes have poses.
void SlamSystem::PlaceEarlyFrames() {
  const auto& [first, first_keyframe] = *map_->keyframes.begin();
  const auto& [second, second_keyframe] = *std::prev(map_->keyframes.end());
  const Timestamp origin = first_keyframe.stamp;
  Rigid2 T_start_first, T_start_frame;
  for (const EarlyFrame& frame : before_map_) {
    if (frame.step.has_value()) T_start_frame = T_start_frame * frame.step->T_i_j;
    if (frame.stamp == origin) T_start_first = T_start_frame;
  }
  T_start_frame = Rigid2();
  for (const EarlyFrame& frame : before_map_) {
    if (frame.step.has_value()) T_start_frame = T_start_frame * frame.step->T_i_j;
    const bool is_first = frame.stamp == origin, is_second = frame.stamp == second_keyframe.stamp;
    if (!map_->metric && !is_first && !is_second) continue;
    const Rigid3 T_first_frame = is_first ? Rigid3() : Embed3(T_start_first.Inverse() * T_start_frame);
    trajectory_.Add(
        {frame.stamp, is_second ? second : first, is_second ? Rigid3() : T_first_frame, frame.T_base_camera});
  }
  before_map_.clear();
}

// Frames from before the first recognised view hang on its keyframe by odometry, as far back as that reaches.
void SlamSystem::PlaceFramesBefore(const TrackResult& result) {
  report_.initialized = before_map_.back().stamp;
  std::vector<RecordedFrame> placed;
  Rigid2 T_now_frame;
  for (std::size_t i = before_map_.size(); map_->metric && i-- > 1 && before_map_[i].step.has_value();) {
    const EarlyFrame& frame = before_map_[i - 1];
    T_now_frame = T_now_frame * before_map_[i].step->T_i_j.Inverse();
    placed.push_back({frame.stamp, result.reference, result.T_ref_base * Embed3(T_now_frame), frame.T_base_camera});
  }
  for (auto frame = placed.rbegin(); frame != placed.rend(); ++frame) trajectory_.Add(*frame);
  before_map_.clear();
}

void SlamSystem::TrackFrame(const FramePacket& packet, const FrameFeaturesPtr& features,
                            const std::optional<PlanarMotion>& step, FrameReport* report) {
  CollectMapping(false);
  report->metric = map_->metric;  // of the map the pose is found in: scale may be recovered before this frame is done
  const Stopwatch tracking;
  const bool was_localized = tracker_.localized();
  const bool may_make_keyframe = !pending_.has_value() && !localizing();
  TrackResult result =
      tracker_.Track({packet.image.stamp, features, packet.T_base_camera, step, may_make_keyframe}, *map_);
  report->track_ms = tracking.Milliseconds();
  AddSinceKeyframe(step, result);
  report->state = result.status;
  report->inliers = result.inliers;
  report->covariance = result.covariance + CovarianceOfMapAt(result.T_map_base);
  report->odometry_rejected = result.odometry_rejected;
  report_.odometry_rejected += result.odometry_rejected ? 1 : 0;
  constexpr std::size_t kEnoughSightings = 200'000;  // a robot that stands for hours makes no keyframe to take them
  if (sightings_.predicted_visible.size() < kEnoughSightings) {
    sightings_.predicted_visible.insert(sightings_.predicted_visible.end(), result.matches.visible.begin(),
                                        result.matches.visible.end());
    std::copy_if(result.matches.landmarks.begin(), result.matches.landmarks.end(), std::back_inserter(sightings_.found),
                 [](LandmarkId id) { return id.valid(); });
  }
  if (!was_localized) before_map_.push_back({packet.image.stamp, packet.T_base_camera, step});
  if (!map_->metric) report->waiting_for = scale_missing_;
  if (!tracker_.localized()) {
    report->state = TrackingState::kInitializing;
    report->waiting_for = "a view that the saved map knows";
  }
  if (result.status == TrackingState::kLost) return;
  if (result.jumped) since_keyframe_.reset();  // odometry did not lead here
  if (!was_localized) PlaceFramesBefore(result);
  report->T_map_base = result.T_map_base;
  T_map_base_last_ = result.T_map_base;
  const bool on_odometry = result.status == TrackingState::kOdometry;
  trajectory_.Add({packet.image.stamp, result.reference, result.T_ref_base, packet.T_base_camera, on_odometry});
  if (!localizing()) sweeps_.Add(packet, trajectory_.size() - 1);
  if (result.wants_keyframe && !pending_.has_value()) {
    report->keyframe = true;
    const Stopwatch mapping;
    Propose(packet, features, std::move(result));
    report->map_ms = mapping.Milliseconds();
  }
}

// Odometry since the last keyframe; where the wheels slipped it counts for less, and the slip is counted once.
void SlamSystem::AddSinceKeyframe(const std::optional<PlanarMotion>& step, const TrackResult& result) {
  if (!step.has_value() || !since_keyframe_.has_value()) {
    since_keyframe_.reset();
    return;
  }
  if (result.odometry_rejected && !slipping_) ++report_.slips;
  slipping_ = result.odometry_rejected;
  since_keyframe_ = Compose(*since_keyframe_, result.odometry_rejected ? Inflate(*step, result.slip) : *step);
}

void SlamSystem::Propose(const FramePacket& packet, const FrameFeaturesPtr& features, TrackResult result) {
  KeyframeProposal proposal;
  proposal.keyframe = {
      packet.image.stamp, result.T_map_base, packet.T_base_camera, features, std::move(result.matches.landmarks), {},
      result.on_floor};
  if (since_keyframe_.has_value()) proposal.odometry = OverWholeMotion(*since_keyframe_, options_.odometry_noise);
  proposal.sightings = std::move(sightings_);
  proposal.off_floor_since = result.off_floor_since;
  if (packet.T_odom_base.has_value()) {
    std::optional<LaserSweep> own = sweeps_.TakeLatest(*packet.T_odom_base, packet.image.stamp);
    if (own.has_value()) proposal.keyframe.sweeps.push_back(std::move(*own));
  }
  proposal.sweeps = sweeps_.Take(*map_, trajectory_, result.status != TrackingState::kOdometry);
  sightings_ = CountSightings{};
  since_keyframe_.reset();
  if (!packet.odometry.empty() || packet.T_odom_base.has_value()) since_keyframe_ = PlanarMotion{};

  auto task = std::make_shared<std::packaged_task<MappingOutcome()>>(
      [snapshot = map_, proposal = std::move(proposal),
       context = MapperContext{bundle_, options_.mapper, options_.scan_match, options_.scale.systematic,
                               options_.loop}] { return MapKeyframe(*snapshot, proposal, context); });
  pending_ = Pending{task->get_future(), packet.image.stamp, result.T_map_base};
  executor_->Submit([task] { (*task)(); });
  CollectMapping(false);
}

void SlamSystem::CollectMapping(bool wait) {
  if (!pending_.has_value()) return;
  if (!wait && pending_->outcome.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
  MappingOutcome outcome = pending_->outcome.get();
  const Rigid3 T_keyframe_last = pending_->T_map_base.Inverse() * T_map_base_last_;
  const Timestamp stamp = pending_->stamp;
  pending_.reset();
  map_ = std::make_shared<const Map>(std::move(outcome.map));
  trajectory_.OnCulled(outcome.report.keyframes_culled);
  trajectory_.Reanchor(stamp, outcome.report.keyframe);
  ++report_.keyframes_made;
  if (outcome.report.loop.has_value()) report_.loops.emplace_back(stamp, *outcome.report.loop);
  report_.keyframes_culled += static_cast<long>(outcome.report.keyframes_culled.size());
  tracker_.OnKeyframe(*map_, outcome.report.keyframe, T_keyframe_last);
  keyframe_covariance_ = outcome.report.covariance;
  covariance_of_ = outcome.report.keyframe;
  AssessMapScale();
  TryScaleRecovery(stamp);
}

void SlamSystem::Finish() {
  CollectMapping(true);
  if (map_ == nullptr || localizing()) return;
  const std::vector<AddSweeps> sweeps = sweeps_.Take(*map_, trajectory_, true);
  if (!sweeps.empty()) map_ = std::make_shared<const Map>(Apply(*map_, MapEdit(sweeps.begin(), sweeps.end())));
  if (!options_.final_bundle_adjustment) return;
  MeasurementModel context = bundle_;
  constexpr int kFinalIterations = 30;
  context.options.max_iterations = std::max(context.options.max_iterations, kFinalIterations);
  MappingOutcome outcome = AdjustWholeMap(*map_, context);
  map_ = std::make_shared<const Map>(std::move(outcome.map));
  AssessMapScale();
}

}  // namespace planar_vslam
