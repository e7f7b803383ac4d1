#include "planar_vslam/backend/look_back.h"

#include <utility>

#include "stages.h"

namespace planar_vslam {
namespace {

void Append(const MapEdit& steps, MapEdit* edit) { edit->insert(edit->end(), steps.begin(), steps.end()); }

// The closed loop, as the map and as the way there. Error: which step failed.
Expected<LoopClosure> CloseLoopAt(const Map& snapshot, KeyframeId newest, const Loop& loop,
                                  const std::vector<MapTie>& ties, const MapperContext& context) {
  Expected<BentMap> bent = CloseLoop(snapshot, loop, ties);
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
  const BundleResult bundle = AdjustBundle(map, WholeMapRequest(map), model, BundleSolver::kCeres);
  if (bundle.failed()) return Error{bundle.message};
  MapEdit outliers;
  for (const auto& [landmark, keyframe] : bundle.outliers) outliers.emplace_back(EraseObservation{landmark, keyframe});
  Map adjusted = Apply(map, ToEdit(bundle));
  MapCorrection correction = CorrectionBetween(map, adjusted, std::move(outliers));
  return AdjustedMap{std::move(adjusted), std::move(correction), bundle};
}

}  // namespace planar_vslam
