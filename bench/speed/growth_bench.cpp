// What tracking a frame and mapping a keyframe cost in a map of so many keyframes, and the memory of such a map.
//   bench_growth rooms|laps KEYFRAMES [FRAMES=216]
// A map is made up of what a robot sees that has driven so far (growth_world.h); then it drives on for FRAMES frames,
// tracked and mapped by the stages of the pipeline, one after the other on this thread. Prints JSON. Left out: reading
// and extraction of images, laser sweeps and links by them, the closing of loops.
#include <fmt/format.h>

#include <cstdlib>

#include "cost.h"
#include "growth_world.h"
#include "planar_vslam/pipeline/map_accuracy.h"
#include "planar_vslam/pipeline/map_jobs.h"
#include "planar_vslam/pipeline/options.h"
#include "planar_vslam/pipeline/stage_statistics.h"
#include "planar_vslam/pipeline/trajectory_recorder.h"

namespace planar_vslam {
namespace {

// Loops are looked for and never closed: adjusting such maps as a whole is another measurement.
PipelineOptions Options() {
  PipelineOptions options;
  options.loop.min_inliers = GrowthWorld::kKeypoints + 1;
  return options;
}

MapJobsContext JobsContext(const PipelineOptions& o) {
  const MeasurementModel model{GrowthWorld::Camera(), o.odometry_noise,  o.planar, o.bundle,
                               o.pixel_sigma,         o.scan_match.floor};
  return {{model, o.mapper, o.scan_match, o.systematic, o.loop}, o.scale};
}

// The estimator without images: the calls that it makes for a frame and for a keyframe.
class Drive {
 public:
  Drive(const GrowthWorld& world, std::shared_ptr<const Map> map, int first)
      : world_(world),
        context_(JobsContext(options_)),
        tracker_({context_.mapper.model.camera, options_.odometry_noise, options_.planar, options_.tracker,
                  options_.pixel_sigma}),
        next_(first) {
    const auto& [newest, keyframe] = *std::prev(map->keyframes.end());
    session_begin_ = KeyframeId{map->next_keyframe_id};
    since_keyframe_ = Preintegrate(world_.Odometry(next_ - 1, next_ - 1), options_.odometry_noise);
    for (int frame = 0; frame < first; ++frame) {
      const int k = frame / GrowthWorld::kFramesPerKeyframe;
      const KeyframeId reference{static_cast<std::uint32_t>(k)};
      const Rigid2 T_ref_base = world_.PoseOf(k * GrowthWorld::kFramesPerKeyframe).Inverse() * world_.PoseOf(frame);
      trajectory_.Add({GrowthWorld::StampOf(frame), reference, Embed3(T_ref_base), GrowthWorld::CameraMount()});
    }
    tracker_.Start(*map, newest);
    jobs_.emplace(context_, std::move(map), Schedule::kInline, UnknownWheelErrors(context_.mapper.systematic));
  }

  void Frame() {
    const int frame = next_++;
    FrameFeaturesPtr features = world_.ViewOf(frame).features;
    const Stopwatch tracking;
    const PlanarMotion step = Preintegrate(world_.Odometry(frame - 1, frame), options_.odometry_noise);
    TrackResult track =
        tracker_.Track({GrowthWorld::StampOf(frame), features, GrowthWorld::CameraMount(), step}, *jobs_->map());
    track.covariance += CovarianceOfMapAt(track.T_map_base, *jobs_->map(), accuracy_, options_.mount);
    trajectory_.Add({GrowthWorld::StampOf(frame), track.reference, track.T_ref_base, GrowthWorld::CameraMount(),
                     track.status == TrackingState::kOdometry});
    frame_ms_.push_back(tracking.Milliseconds());
    statistics_.Add(track.times);
    tracked_ += track.status == TrackingState::kTracking ? 1 : 0;
    error_ = std::max(error_, (track.T_map_base.translation - Embed3(world_.PoseOf(frame)).translation).norm());
    since_keyframe_ = Compose(since_keyframe_, step);
    Count(track.matches);
    if (track.wants_keyframe) MakeKeyframe(frame, std::move(features), std::move(track));
  }

  std::string Json(double bytes_a_keyframe, std::size_t landmarks) const {
    std::string stages;
    for (const auto& [stage, times] : statistics_.stages()) {
      stages += fmt::format(R"({}"{}": {{"count": {}, "mean": {:.4f}}})", stages.empty() ? "" : ", ", stage,
                            times.count(), times.sum() / static_cast<double>(times.count()));
    }
    return fmt::format(
        R"({{"landmarks": {}, "tracked": {}, "largest_error_m": {:.4f}, "bytes_a_keyframe": {:.0f}, "frame_ms": {}, )"
        R"("keyframe_ms": {}, "stages_ms": {{{}}}}})",
        landmarks, tracked_, error_, bytes_a_keyframe, TimesJson(frame_ms_), TimesJson(keyframe_ms_), stages);
  }
  int tracked() const { return tracked_; }

 private:
  void Count(const FrameMatches& matches) {
    for (const LandmarkId id : matches.visible) sightings_.predicted_visible.push_back(id);
    for (const LandmarkId id : matches.landmarks) {
      if (id.valid()) sightings_.found.push_back(id);
    }
  }

  void MakeKeyframe(int frame, FrameFeaturesPtr features, TrackResult track) {
    KeyframeProposal proposal;
    proposal.keyframe = {GrowthWorld::StampOf(frame),
                         track.T_map_base,
                         GrowthWorld::CameraMount(),
                         std::move(features),
                         std::move(track.matches.landmarks),
                         {},
                         track.on_floor};
    proposal.odometry = OverWholeMotion(since_keyframe_, options_.odometry_noise);
    proposal.sightings = std::exchange(sightings_, {});
    proposal.off_floor_since = track.off_floor_since;
    proposal.session_begin = session_begin_;
    since_keyframe_ = PlanarMotion{};
    const Stopwatch mapping;
    jobs_->AddKeyframe(std::move(proposal));
    StageTimes times;
    for (const MapChange& change : jobs_->Collect(true)) {
      Follow(change, track.T_map_base);
      times.insert(times.end(), change.times.begin(), change.times.end());
    }
    keyframe_ms_.push_back(mapping.Milliseconds());
    statistics_.Add(times);
  }

  void Follow(const MapChange& change, const Rigid3& T_map_base) {
    trajectory_.OnCulled(change.keyframes_culled);
    if (change.accuracy.has_value()) accuracy_ = change.accuracy;
    if (!change.keyframe.has_value()) return;
    trajectory_.Reanchor(change.keyframe->stamp, change.keyframe->id);
    tracker_.OnKeyframe(*change.map, change.keyframe->id, change.keyframe->T_map_base_proposed.Inverse() * T_map_base);
  }

  const GrowthWorld& world_;
  const PipelineOptions options_ = Options();
  const MapJobsContext context_;
  Tracker tracker_;
  TrajectoryRecorder trajectory_;
  std::optional<MapJobs> jobs_;
  std::optional<KeyframeAccuracy> accuracy_;
  KeyframeId session_begin_;
  PlanarMotion since_keyframe_;
  CountSightings sightings_;
  std::vector<double> frame_ms_, keyframe_ms_;
  StageStatistics statistics_;
  int next_;
  int tracked_ = 0;
  double error_ = 0.0;  // m
};

int Main(int argc, char** argv) {
  const std::optional<Growth> growth = argc > 2 ? GrowthOf(argv[1]) : std::nullopt;
  const int keyframes = argc > 2 ? std::atoi(argv[2]) : 0;
  const int frames = argc > 3 ? std::atoi(argv[3]) : GrowthWorld::kFramesPerRoom;
  if (!growth.has_value() || keyframes < 2 || frames < 1) {
    fmt::print(stderr, "usage: bench_growth rooms|laps KEYFRAMES [FRAMES={}]\n", GrowthWorld::kFramesPerRoom);
    return 2;
  }
  const int first = (keyframes - 1) * GrowthWorld::kFramesPerKeyframe + 1;
  const GrowthWorld world(*growth, first + frames);
  const double before = HeapBytes();
  auto map = std::make_shared<const Map>(world.MapOf(keyframes, PipelineOptions{}.odometry_noise));
  const double bytes = (HeapBytes() - before) / keyframes;
  const std::size_t landmarks = map->landmarks.size();
  Drive drive(world, std::move(map), first);
  for (int i = 0; i < frames; ++i) drive.Frame();
  if (drive.tracked() < frames) {
    fmt::print(stderr, "bench_growth: {} of {} frames tracked; expected all\n", drive.tracked(), frames);
    return 1;
  }
  fmt::print("{}\n", drive.Json(bytes, landmarks));
  return 0;
}

}  // namespace
}  // namespace planar_vslam

int main(int argc, char** argv) { return planar_vslam::Main(argc, argv); }
