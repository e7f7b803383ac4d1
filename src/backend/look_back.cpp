#include "planar_vslam/backend/look_back.h"

#include <utility>

#include "stages.h"

namespace planar_vslam {
namespace {

void Append(const MapEdit& steps, MapEdit* edit) { edit->insert(edit->end(), steps.begin(), steps.end()); }

bool SeesEnough(const Keyframe& keyframe) {
  constexpr std::ptrdiff_t kFewest = 20;  // landmarks
  return std::count_if(keyframe.landmarks.begin(), keyframe.landmarks.end(),
                       [](LandmarkId id) { return id.valid(); }) >= kFewest;
}

// Keyframes that images hold off the floor against its prior, three or more in a row: they stand on a ramp that was not
// noticed. The first keyframe is the map's origin.
std::vector<KeyframeId> HeldAgainstTheFloor(const Map& map, const PlanarPriorOptions& planar) {
  constexpr double kLimitSquared = 25.0;  // five sigmas; chosen by looking at ramps (ADR 11)
  constexpr std::size_t kInARow = 3;
  std::vector<KeyframeId> ids, row;
  if (!map.metric || planar.mode == PlanarMode::kOff) return ids;
  const FloorSigmas sigmas = FloorSigmasOf(planar, true);
  for (const auto& [id, keyframe] : map.keyframes) {
    const bool held = id != map.keyframes.begin()->first && keyframe.on_floor && SeesEnough(keyframe) &&
                      PlanarPriorResidual(keyframe.T_map_base, sigmas, nullptr).squaredNorm() > kLimitSquared;
    if (held) row.push_back(id);
    if (held && row.size() == kInARow) ids.insert(ids.end(), row.begin(), row.end());
    if (held && row.size() > kInARow) ids.push_back(id);
    if (!held && keyframe.on_floor) row.clear();
  }
  return ids;
}

// Adds what one more adjustment took; costs are of the first at its start and of the last at its end.
void AddTo(const BundleSummary& bundle, BundleSummary* sum) {
  const double initial_cost = sum->observations > 0 ? sum->initial_cost : bundle.initial_cost;
  const int iterations = sum->iterations + bundle.iterations;
  StageTimes times = std::move(sum->times);
  times.insert(times.end(), bundle.times.begin(), bundle.times.end());
  *sum = bundle;
  sum->initial_cost = initial_cost;
  sum->iterations = iterations;
  sum->times = std::move(times);
}

// The closed loop, as the map and as the way there. Error: which step failed.
Expected<LoopClosure> CloseLoopAt(const Map& snapshot, KeyframeId newest, const Loop& loop,
                                  const std::vector<MapTie>& ties, const MapperContext& context) {
  Expected<BentMap> bent = CloseLoop(snapshot, loop, ties, context.model.planar);
  if (!bent.ok()) return Error{"pose graph: " + bent.error().message};
  auto& [map, structure] = *bent;
  for (const LoopView& view : loop.views) Append(FuseWithNeighbors(&map, view.keyframe, context), &structure);
  const MapEdit laser = LinkByLaser(map, newest, context.scan_match);
  map = Apply(std::move(map), laser);
  Append(laser, &structure);
  Expected<AdjustedMap> adjusted = AdjustWholeMap(map, context.model);
  if (!adjusted.ok()) return Error{"bundle adjustment: " + adjusted.error().message};
  Append(adjusted->correction.structure, &structure);
  const Rigid3 T_before_map = snapshot.keyframes.At(newest).T_map_base.Inverse();
  MapCorrection correction = CorrectionBetween(snapshot, adjusted->map, std::move(structure));
  return LoopClosure{ClosedLoop{loop.old, T_before_map * adjusted->map.keyframes.At(newest).T_map_base},
                     std::make_shared<const Map>(std::move(adjusted->map)), std::move(correction),
                     std::move(adjusted->bundle)};
}

}  // namespace

LookBackOutcome LookBack(const Map& snapshot, KeyframeId newest, const MapperContext& context, MapDrift* drift) {
  LookBackOutcome outcome;
  outcome.keyframe = newest;
  if (!snapshot.metric) return outcome;
  StageClock clock(&outcome.times);
  drift->Follow(snapshot);
  clock.End("loop.ties");
  outcome.covariance = drift->CovarianceOfNewest();
  clock.End("loop.covariance");
  const std::optional<Loop> loop = FindLoop(snapshot, newest, *drift, context.model, context.loop);
  clock.End("loop.search");
  if (!loop.has_value()) return outcome;

  Expected<LoopClosure> closed = CloseLoopAt(snapshot, newest, *loop, drift->ties().All(), context);
  clock.End("loop.close");
  if (!closed.ok()) {
    outcome.failure = closed.error().message;
    return outcome;
  }
  outcome.closed = std::move(closed).value();
  drift->Follow(*outcome.closed->map);
  clock.End("loop.ties");
  outcome.covariance = drift->CovarianceOfNewest();
  clock.End("loop.covariance");
  return outcome;
}

Expected<AdjustedMap> AdjustWholeMap(const Map& map, const MeasurementModel& model) {
  constexpr int kRounds = 3;  // each lets go of what stands beside what the one before has let go of
  Map adjusted = map;
  MapEdit structure;
  BundleSummary summary;
  for (int round = 0; round < kRounds; ++round) {
    const BundleResult bundle = AdjustBundle(adjusted, WholeMapRequest(adjusted), model, BundleSolver::kCeres);
    if (bundle.failed()) return Error{bundle.message};
    adjusted = Apply(std::move(adjusted), ToEdit(bundle));
    for (const auto& [landmark, keyframe] : bundle.outliers) {
      structure.emplace_back(EraseObservation{landmark, keyframe});
    }
    AddTo(bundle, &summary);
    if (round + 1 == kRounds) break;
    const SetOffFloor off{HeldAgainstTheFloor(adjusted, model.planar)};
    if (off.ids.empty()) break;
    adjusted = Apply(std::move(adjusted), {off});
    structure.emplace_back(off);
  }
  MapCorrection correction = CorrectionBetween(map, adjusted, std::move(structure));
  return AdjustedMap{std::move(adjusted), std::move(correction), std::move(summary)};
}

}  // namespace planar_vslam
