#include "planar_vslam/optimize/bundle_adjustment.h"

#include <algorithm>
#include <cmath>

#include "bundle_ceres.h"
#include "bundle_problem.h"
#include "schur_solver.h"

namespace planar_vslam {
namespace {

BundleOutcome Solve(BundleProblem* problem, BundleSolver solver, const std::atomic<bool>* hurry) {
  BundleLimits limits;
  limits.max_iterations = problem->options.max_iterations;
  if (solver == BundleSolver::kCeres) return SolveWithCeres(problem, limits);
  limits.relative_gain = problem->options.relative_gain;
  limits.hurry = hurry;
  return SolveWithSchur(problem, limits);
}

void Take(const BundleOutcome& outcome, BundleResult* result) {
  if (result->iterations == 0) result->initial_cost = outcome.initial_cost;
  result->converged = outcome.usable;
  result->message = outcome.message;
  result->final_cost = outcome.final_cost;
  result->iterations += outcome.iterations;
  result->times.insert(result->times.end(), outcome.times.begin(), outcome.times.end());
}

void Report(const BundleProblem& problem, BundleResult* result) {
  for (const BundlePose& pose : problem.poses) {
    if (pose.freedom != PoseFreedom::kFixed) result->poses.emplace_back(pose.id, pose.T_map_base);
  }
  result->points.reserve(problem.points.size());
  for (const BundlePoint& point : problem.points) result->points.emplace_back(point.id, point.p_map);
  for (const BundleObservation& o : problem.observations) {
    if (!o.inlier) result->outliers.emplace_back(problem.points[o.point].id, problem.poses[o.pose].id);
  }
}

BundleResult Adjust(const Map& map, const BundleRequest& request, const MeasurementModel& context, BundleSolver solver,
                    const std::atomic<bool>* hurry) {
  BundleResult result;
  const Stopwatch build;
  BundleProblem problem = MakeBundleProblem(map, request, context);
  RefreshWhitening(&problem);
  result.times.push_back({"bundle.build", build.Milliseconds()});
  if (problem.observations.empty() || request.free_keyframes.empty()) {
    result.message = "nothing to adjust";
    return result;
  }
  result.observations = problem.observations.size();
  const auto solve_and_classify = [&] {
    Take(Solve(&problem, solver, hurry), &result);
    const Stopwatch classify;
    const std::size_t changed = Classify(&problem);
    result.times.push_back({"bundle.classify", classify.Milliseconds()});
    return changed;
  };
  const bool any = solve_and_classify() > 0;
  const bool hurried = hurry != nullptr && hurry->load(std::memory_order_relaxed);
  if (result.converged && context.options.drop_outliers && any && !hurried) solve_and_classify();
  if (result.converged) Report(problem, &result);
  return result;
}

// Whether the origin has tilted by more than a camera sways.
bool OriginTips(const BundleResult& result, const BundleRequest& request, const PlanarPriorOptions& planar) {
  if (!result.converged || result.poses.empty() || result.poses.front().first != request.origin) return false;
  return result.poses.front().second.R()(2, 2) < std::cos(planar.sigma_tilt);
}

}  // namespace

BundleResult AdjustBundle(const Map& map, const BundleRequest& request, const MeasurementModel& context,
                          BundleSolver solver, const std::atomic<bool>* hurry) {
  BundleResult result = Adjust(map, request, context, solver, hurry);
  if (!OriginTips(result, request, context.planar)) return result;
  // It is not the first keyframe that stands askew, but others on a ramp that are not known to be off the floor yet.
  BundleRequest held = request;
  held.origin = KeyframeId();
  return Adjust(map, held, context, solver, hurry);
}

MapEdit ToEdit(const BundleResult& result) {
  MapEdit edit;
  edit.reserve(result.poses.size() + result.points.size() + result.outliers.size());
  for (const auto& [id, T_map_base] : result.poses) edit.emplace_back(SetKeyframePose{id, T_map_base});
  for (const auto& [id, p_map] : result.points) edit.emplace_back(SetLandmarkPosition{id, p_map});
  for (const auto& [landmark, keyframe] : result.outliers) edit.emplace_back(EraseObservation{landmark, keyframe});
  return edit;
}

BundleRequest WholeMapRequest(const Map& map) {
  BundleRequest request;
  for (const auto& [id, keyframe] : map.keyframes) {
    (request.fixed_keyframes.empty() ? request.fixed_keyframes : request.free_keyframes).push_back(id);
  }
  if (!request.fixed_keyframes.empty()) request.origin = request.fixed_keyframes.front();
  for (const auto& [id, landmark] : map.landmarks) {
    if (landmark.observations.size() >= 2) request.landmarks.push_back(id);
  }
  return request;
}

}  // namespace planar_vslam
