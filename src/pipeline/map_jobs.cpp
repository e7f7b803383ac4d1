#include "planar_vslam/pipeline/map_jobs.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "planar_vslam/geometry/check.h"
#include "planar_vslam/map/map_union.h"
#include "planar_vslam/planar/scale_recovery.h"

namespace planar_vslam {
namespace {

constexpr int kWriterNiceness = 5;     // tracking comes first...
constexpr int kSearcherNiceness = 10;  // ...and what nobody waits for last

void AddBundle(const BundleSummary& bundle, MapChange* change) {
  change->bundle_iterations = bundle.iterations;
  change->times.insert(change->times.end(), bundle.times.begin(), bundle.times.end());
}

// Corrects the map's links where the wheels turn out to read wrong in another way than they are corrected by.
void LearnWheels(const LearntWheels& wheels, const MapJobsContext& context, Map* map, MapChange* change) {
  const Stopwatch learning;
  const MapScale& scale = *change->scale;
  const WheelErrors now = LearnWheelErrors(*map, wheels.first, wheels.prior, wheels.applied,
                                           scale.floor_in_parts ? scale.floor : std::nullopt, context.mapper.model);
  if (IsNews(now, wheels.applied)) {
    const WheelErrors& was = wheels.applied;
    *map = Apply(std::move(*map),
                 {CorrectOdometryLinks{wheels.first,
                                       std::exp(now.log_length - was.log_length),
                                       std::exp(now.log_turn - was.log_turn),
                                       {now.noise.way / was.noise.way, now.noise.turn / was.noise.turn}}});
    change->wheels = now;
    change->scale = AssessScale(*map, context.scale, context.mapper.systematic);
  }
  change->times.push_back({"map.learn_wheels", learning.Milliseconds()});
}

MapChange MapProposal(const Map& snapshot, const KeyframeProposal& proposal, const MapJobsContext& context,
                      bool assess_scale, const std::optional<LearntWheels>& wheels, const std::atomic<bool>& hurry) {
  MappingOutcome outcome = MapKeyframe(snapshot, proposal, context.mapper, &hurry);
  MapChange change;
  change.times = std::move(outcome.report.times);
  if (assess_scale) {
    const Stopwatch assessing;
    change.scale = AssessScale(outcome.map, context.scale, context.mapper.systematic);
    change.times.push_back({"map.assess_scale", assessing.Milliseconds()});
    if (wheels.has_value()) LearnWheels(*wheels, context, &outcome.map, &change);
  }
  change.keyframe =
      MapChange::NewKeyframe{outcome.report.keyframe, proposal.keyframe.stamp, proposal.keyframe.T_map_base};
  change.keyframes_culled = std::move(outcome.report.keyframes_culled);
  if (outcome.report.bundle.failed()) change.failure = "local bundle adjustment: " + outcome.report.bundle.message;
  AddBundle(outcome.report.bundle, &change);
  change.map = std::make_shared<const Map>(std::move(outcome.map));
  return change;
}

MapChange Scaled(const Map& snapshot, double log_scale, Timestamp stamp, const ScanMatchOptions& scan_match) {
  const std::vector<LeverArmSample> samples = LinkedTrack(snapshot);
  ScaleReport report{RecoverScale(samples, ScaleMethod::kSteps, 0.0).value_or(0.0),
                     RecoverScale(samples, ScaleMethod::kCentroids, 0.0).value_or(0.0),
                     std::exp(log_scale),
                     {},
                     std::prev(snapshot.keyframes.end())->first,
                     stamp};
  for (const auto& [id, keyframe] : snapshot.keyframes) {
    report.unscaled_cameras.emplace_back(keyframe.stamp, keyframe.T_map_camera());
  }
  MapChange change;
  change.map = std::make_shared<const Map>(LinkedByLaser(ScaledToMetric(snapshot, report.applied), scan_match));
  change.scaled = std::move(report);
  return change;
}

MapChange WithImageOffset(const Map& snapshot, double offset) {
  MapChange change;
  change.map = std::make_shared<const Map>(Apply(snapshot, {::planar_vslam::SetImageOffset{offset}}));
  change.image_offset = offset;
  return change;
}

MeasurementModel WithIterations(MeasurementModel model, int max_iterations) {
  model.options.max_iterations = max_iterations;
  return model;
}

}  // namespace

MapJobs::MapJobs(const MapJobsContext& context, std::shared_ptr<const Map> map, Schedule schedule,
                 const WheelErrors& wheels, std::shared_ptr<const Map> known)
    : context_(context),
      map_(std::move(map)),
      known_(std::move(known)),
      wheels_{KeyframeId{map_->next_keyframe_id}, wheels, wheels},
      wheels_learned_at_(map_->next_keyframe_id),
      searcher_(MakeExecutor(schedule, kSearcherNiceness)),
      writer_(MakeExecutor(schedule, kWriterNiceness)) {}

MapJobs::~MapJobs() = default;

void MapJobs::Write(std::function<MapChange()> job, bool corrects) {
  PV_CHECK(!writing_.has_value(), "two jobs for one writer");
  writing_ = Writing{Submit(writer_.get(), std::move(job)), corrects};
}

// The scale of a metric map is assessed for those who read the report, at the cost of a look at the whole map: in a
// large one not at every keyframe.
bool MapJobs::MayAssessScale() {
  constexpr std::size_t kAtEvery = 50;  // keyframes in the map, up to which it is at every new one
  const std::size_t since = map_->next_keyframe_id - scale_assessed_at_;
  if (map_->metric && since < map_->keyframes.size() / kAtEvery) return false;
  scale_assessed_at_ = map_->next_keyframe_id;
  return true;
}

// With every tenth more of keyframes they have something new to say of the wheels. Where the scale is assessed, too:
// what the floor says comes from there.
std::optional<LearntWheels> MapJobs::MayLearnWheels() {
  constexpr std::uint32_t kLeast = 10, kShare = 10;
  const std::uint32_t since = map_->next_keyframe_id - wheels_learned_at_;
  const std::uint32_t driven = map_->next_keyframe_id - wheels_.first.value;
  if (!context_.mapper.systematic.learn || !map_->metric || since < std::max(kLeast, driven / kShare)) return {};
  wheels_learned_at_ = map_->next_keyframe_id;
  return wheels_;
}

void MapJobs::AddKeyframe(KeyframeProposal proposal) {
  hurry_.store(false, std::memory_order_relaxed);
  const bool assess_scale = MayAssessScale();
  const std::optional<LearntWheels> wheels = assess_scale ? MayLearnWheels() : std::nullopt;
  Write(
      [this, snapshot = map_, assess_scale, wheels, proposal = std::move(proposal)] {
        return MapProposal(*snapshot, proposal, context_, assess_scale, wheels, hurry_);
      },
      false);
}

void MapJobs::MakeMetric(double log_scale, Timestamp stamp) {
  Write([this, snapshot = map_, log_scale,
         stamp] { return Scaled(*snapshot, log_scale, stamp, context_.mapper.scan_match); },
        false);
}

std::vector<MapChange> MapJobs::Collect(bool wait) {
  std::vector<MapChange> changes;
  if (!retired_.empty()) writer_->Submit([maps = std::exchange(retired_, {})] {});
  do {
    if (writing_.has_value() && IsReady(writing_->change, wait)) {
      MapChange change = writing_->change.get();
      writing_.reset();
      retired_.push_back(std::exchange(map_, change.map));
      look_back_due_ = look_back_due_ || (change.keyframe.has_value() && map_->metric);
      if (change.wheels.has_value()) wheels_.applied = *change.wheels;
      if (change.joined.has_value()) {
        known_.reset();
        meetings_.clear();
        look_back_due_ = true;  // how well its poses are known in the frame of the known map
      }
      const bool moved = change.scaled.has_value() || change.image_offset.has_value();
      if (moved) AdjustWholeMap(context_.mapper.model.options.max_iterations);
      changes.push_back(std::move(change));
    }
    if (searching_.has_value() && IsReady(*searching_, wait)) {
      Found found = searching_->get();
      searching_.reset();
      Take(std::move(found), &changes);
    }
  } while (StartDue());
  return changes;
}

void MapJobs::AdjustWholeMap(int max_iterations) { adjust_due_ = std::max(adjust_due_.value_or(0), max_iterations); }

// Whether something was started. A correction is applied before a new search starts.
bool MapJobs::StartDue() {
  bool started = false;
  // Lengths of a map that has been made metric since are not those of the snapshot.
  if (correction_.has_value() && correction_->snapshot->metric != map_->metric) {
    retired_.push_back(std::move(correction_->corrected));
    correction_.reset();
  }
  if (correction_.has_value() && !writing_.has_value()) {
    auto found = std::make_shared<const Found>(*std::exchange(correction_, std::nullopt));
    Write([this, found, now = map_] { return Correct(*found, now); }, true);
    started = true;
  }
  if (image_offset_due_.has_value() && !busy()) {
    const double offset = *std::exchange(image_offset_due_, std::nullopt);
    Write([snapshot = map_, offset] { return WithImageOffset(*snapshot, offset); }, false);
    started = true;
  }
  const bool correcting = correction_.has_value() || (writing_.has_value() && writing_->corrects);
  if (!searching_.has_value() && !correcting && (adjust_due_.has_value() || look_back_due_)) {
    Search();
    started = true;
  }
  return started;
}

void MapJobs::Search() {
  if (adjust_due_.has_value()) {
    const int max_iterations = *std::exchange(adjust_due_, std::nullopt);
    searching_ =
        Submit(searcher_.get(), [this, snapshot = map_, max_iterations] { return Adjust(snapshot, max_iterations); });
  } else {
    look_back_due_ = false;
    searching_ = Submit(searcher_.get(), [this, snapshot = map_, known = known_, meetings = meetings_] {
      Found joined;
      if (known != nullptr && Join(snapshot, known, meetings, &joined)) return joined;
      Found found = LookBackFrom(snapshot);
      StageTimes& times = found.change.times;
      times.insert(times.begin(), joined.change.times.begin(), joined.change.times.end());
      if (found.change.failure.empty()) found.change.failure = std::move(joined.change.failure);
      return found;
    });
  }
}

MapJobs::Found MapJobs::Adjust(const std::shared_ptr<const Map>& snapshot, int max_iterations) const {
  Found found;
  found.snapshot = snapshot;
  const Stopwatch adjusting;
  Expected<AdjustedMap> adjusted =
      planar_vslam::AdjustWholeMap(*snapshot, WithIterations(context_.mapper.model, max_iterations));
  if (adjusted.ok()) {
    found.corrected = std::make_shared<const Map>(std::move(adjusted->map));
    found.correction = std::move(adjusted->correction);
    AddBundle(adjusted->bundle, &found.change);
  } else {
    found.change.failure = "adjustment of the whole map: " + adjusted.error().message;
  }
  found.change.times.push_back({"map.adjust_whole", adjusting.Milliseconds()});
  return found;
}

MapJobs::Found MapJobs::LookBackFrom(const std::shared_ptr<const Map>& snapshot) {
  const auto& [newest, keyframe] = *std::prev(snapshot->keyframes.end());
  if (!drift_.has_value()) drift_.emplace(context_.mapper.model, context_.mapper.systematic);
  LookBackOutcome outcome = LookBack(*snapshot, newest, context_.mapper, &*drift_);
  Found found;
  found.snapshot = snapshot;
  found.change.failure = std::move(outcome.failure);
  found.change.times = std::move(outcome.times);
  const Map& known = outcome.closed.has_value() ? *outcome.closed->map : *snapshot;
  found.change.accuracy =
      KeyframeAccuracy{newest, ProjectToPlane(known.keyframes.At(newest).T_map_base), outcome.covariance};
  if (outcome.closed.has_value()) {
    AddBundle(outcome.closed->bundle, &found.change);
    found.corrected = std::move(outcome.closed->map);
    found.correction = std::move(outcome.closed->correction);
    found.change.loop = LoopReport{outcome.closed->loop, keyframe.stamp, {}};
  }
  return found;
}

// Whether the known map and this one have become one.
bool MapJobs::Join(const std::shared_ptr<const Map>& snapshot, const std::shared_ptr<const Map>& known,
                   const std::vector<Meeting>& meetings, Found* found) {
  const Stopwatch joining;
  if (!joiner_.has_value()) joiner_.emplace(known, context_.mapper);
  Expected<std::optional<MapJunction>> junction = joiner_->Try(*snapshot, meetings);
  found->change.times.push_back({"map.join", joining.Milliseconds()});
  if (!junction.ok()) found->change.failure = "joining of two maps: " + junction.error().message;
  if (!junction.ok() || !junction->has_value()) return false;
  MapJunction& joined = **junction;
  found->snapshot = snapshot;
  found->known = known;
  found->corrected = std::move(joined.map);
  found->correction = std::move(joined.correction);
  AddBundle(joined.bundle, &found->change);
  const MapAlignment& alignment = joined.alignment;
  found->change.joined = JoinReport{alignment.T_known_other,
                                    alignment.covariance,
                                    alignment.apart,
                                    std::prev(snapshot->keyframes.end())->second.stamp,
                                    {}};
  joiner_.reset();
  drift_.reset();  // of a map that it does not know the beginning of
  return true;
}

void MapJobs::Take(Found found, std::vector<MapChange>* changes) {
  if (found.corrected != nullptr) {
    correction_ = std::move(found);
    return;
  }
  retired_.push_back(std::move(found.snapshot));
  found.change.map = map_;
  changes->push_back(std::move(found.change));
}

// On the writer: what the searcher found, in the map as it is by now.
MapChange MapJobs::Correct(const Found& found, const std::shared_ptr<const Map>& now) const {
  MapChange change = found.change;
  const Stopwatch correcting;
  if (now == found.snapshot) {
    change.map = found.corrected;
  } else {
    Map beside = found.known != nullptr ? UnionOf(*found.known, *now) : *now;
    change.map = std::make_shared<const Map>(Rebase(std::move(beside), found.correction));
  }
  change.scale = AssessScale(*change.map, context_.scale, context_.mapper.systematic);
  change.times.push_back({"map.correct", correcting.Milliseconds()});
  return change;
}

void MapJobs::Edit(const MapEdit& edit) {
  PV_CHECK(!busy() && !searching_.has_value(), "an edit beside a job");
  map_ = std::make_shared<const Map>(Apply(*map_, edit));
}

Expected<MapChange> MapJobs::AdjustNow(int max_iterations) {
  PV_CHECK(!busy() && !searching_.has_value(), "an adjustment beside a job");
  const Found found = Adjust(map_, max_iterations);
  if (found.corrected == nullptr) return Error{found.change.failure};
  MapChange change = Correct(found, map_);
  map_ = change.map;
  change.scale = FinalScale();
  return change;
}

// The sources of scale say how well they know the map's where they look; what a whole map's is known by are all its
// ties.
MapScale MapJobs::FinalScale() const {
  MapScale scale = AssessScale(*map_, context_.scale, context_.mapper.systematic);
  if (!map_->metric || !scale.fused.has_value()) return scale;
  const MapUncertainty uncertainty(*map_, TiesOf(*map_, context_.mapper.model), context_.mapper.systematic);
  scale.fused->sigma = uncertainty.ScaleSigma().value_or(scale.fused->sigma);
  return scale;
}

}  // namespace planar_vslam
