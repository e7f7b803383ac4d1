#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "commands.h"
#include "planar_vslam/io/consistency.h"
#include "planar_vslam/io/evaluation.h"
#include "planar_vslam/io/trajectory.h"

namespace planar_vslam {
namespace {

constexpr double kLongestOffset = 4e9;  // s; shifts between any two epochs of today fit

struct EvaluateArguments {
  std::string estimate, groundtruth, plot, grid, beside, covariances;
  std::string alignment = "se3";
  std::vector<double> transform;  // T_truth_estimate: x m, y m, yaw rad
  double time_offset = 0.0;       // s, added to the estimate's stamps
  bool json = false;
};

std::map<std::string, EvaluationAlignment> Alignments() {
  return {{"none", EvaluationAlignment::kNone},
          {"se2", EvaluationAlignment::kSe2},
          {"se3", EvaluationAlignment::kSe3},
          {"sim3", EvaluationAlignment::kSim3},
          {"first", EvaluationAlignment::kFirst}};
}

// T_truth_estimate, where it was given.
std::optional<Rigid3> TransformOf(const EvaluateArguments& arguments) {
  const std::vector<double>& t = arguments.transform;
  if (t.empty()) return std::nullopt;
  return Embed3(Rigid2(t[0], t[1], t[2]));
}

// `shift` has been added to the estimate's stamps.
int PrintConsistency(const EvaluateArguments& arguments, Timestamp shift, const Trajectory& estimate,
                     const Trajectory& truth) {
  Expected<std::vector<StampedCovariance>> covariances = ReadCovariances(arguments.covariances);
  if (!covariances) return Fail(kExitBadInput, covariances.error().message);
  for (StampedCovariance& covariance : *covariances) covariance.stamp.nanoseconds += shift.nanoseconds;
  const Expected<Consistency> consistency = EvaluateConsistency(estimate, *covariances, truth, TransformOf(arguments));
  if (!consistency) return Fail(kExitFailure, arguments.covariances + ": " + consistency.error().message);
  fmt::print("{}\n", arguments.json
                         ? fmt::format("{{\"poses\": {}, \"mean_nees\": {:.6g}, \"within_95\": {:.6g}}}",
                                       consistency->poses, consistency->mean_nees, consistency->within_95)
                         : fmt::format("NEES {:.2f} over {} poses (3 expected), {:.1f} % within their 95 %",
                                       consistency->mean_nees, consistency->poses, 100.0 * consistency->within_95));
  return kExitSuccess;
}

Expected<TrajectoryErrors> ErrorsOf(const EvaluateArguments& arguments, const Trajectory& estimate,
                                    const Trajectory& truth) {
  const std::optional<Rigid3> T_truth_estimate = TransformOf(arguments);
  if (!T_truth_estimate) return EvaluateTrajectory(estimate, truth, Alignments().at(arguments.alignment));
  return EvaluateTrajectory(estimate, truth, Similarity3{1.0, *T_truth_estimate});
}

// What there is to be drawn beside the trajectories.
Expected<PlotLayers> ReadLayers(const EvaluateArguments& arguments, const Trajectory& truth) {
  PlotLayers layers;
  if (!arguments.grid.empty()) {
    Expected<OccupancyGrid2d> grid = ReadMapServerFiles(arguments.grid);
    if (!grid) return grid.error();
    layers.grid = std::move(*grid);
  }
  if (arguments.beside.empty()) return layers;
  Expected<Trajectory> beside = ReadTrajectory(arguments.beside);
  if (!beside) return beside.error();
  const EvaluationAlignment alignment =
      arguments.transform.empty() ? Alignments().at(arguments.alignment) : EvaluationAlignment::kSe2;
  const Expected<TrajectoryErrors> errors = EvaluateTrajectory(*beside, truth, alignment);
  if (!errors) return Error{arguments.beside + ": " + errors.error().message};
  layers.beside = std::move(*beside);
  layers.truth_from_beside = errors->truth_from_estimate;
  layers.beside_name =
      fmt::format("{}: {:.3f} m RMSE", std::filesystem::path(arguments.beside).stem().string(), errors->ate.rmse);
  return layers;
}

int Evaluate(const EvaluateArguments& arguments) {
  for (const double number : arguments.transform) {
    if (!std::isfinite(number)) return Fail(kExitBadInput, "--transform: expected three finite numbers x,y,yaw");
  }
  Expected<Trajectory> estimate = ReadTrajectory(arguments.estimate);
  if (!estimate) return Fail(kExitBadInput, estimate.error().message);
  const Expected<Trajectory> truth = ReadTrajectory(arguments.groundtruth);
  if (!truth) return Fail(kExitBadInput, truth.error().message);
  const Timestamp shift = Timestamp::FromSeconds(arguments.time_offset);
  for (StampedPose& pose : *estimate) pose.stamp.nanoseconds += shift.nanoseconds;
  if (!arguments.covariances.empty()) return PrintConsistency(arguments, shift, *estimate, *truth);
  const Expected<TrajectoryErrors> errors = ErrorsOf(arguments, *estimate, *truth);
  if (!errors) return Fail(kExitFailure, arguments.estimate + ": " + errors.error().message);
  if (!arguments.plot.empty()) {
    const Expected<PlotLayers> layers = ReadLayers(arguments, *truth);
    if (!layers) return Fail(kExitBadInput, layers.error().message);
    const Expected<bool> plotted = WriteSvgPlot(*estimate, *truth, *errors, arguments.plot, *layers);
    if (!plotted) return Fail(kExitFailure, plotted.error().message);
  }
  std::fputs((arguments.json ? ToJson(*errors) : ToText(*errors)).c_str(), stdout);
  return kExitSuccess;
}

}  // namespace

void AddEvaluate(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<EvaluateArguments>();
  CLI::App* command = app.add_subcommand("evaluate", "Errors of a trajectory against ground truth (TUM files)");
  command->add_option("--estimate", arguments->estimate, "Trajectory to evaluate, TUM format")->required();
  command->add_option("--groundtruth", arguments->groundtruth, "True trajectory, TUM format")->required();
  CLI::Option* align = command
                           ->add_option("--align", arguments->alignment,
                                        "How the estimate is laid over the truth; first: by the first pose")
                           ->capture_default_str()
                           ->check(CLI::IsMember(Alignments()));
  command
      ->add_option(
          "--transform", arguments->transform,
          "x,y,yaw (m, rad): from the estimate's frame to the truth's, instead of an alignment of its own: for "
          "poses in a map that was aligned before")
      ->delimiter(',')
      ->expected(3)
      ->excludes(align);
  command->add_option("--time-offset", arguments->time_offset, "Seconds to add to the estimate's stamps")
      ->check(CLI::Range(-kLongestOffset, kLongestOffset));
  command->add_option("--consistency", arguments->covariances,
                      "Instead: NEES of the poses with these covariances (covariance_live.csv), laid over the first "
                      "pose or by --transform");
  command->add_flag("--json", arguments->json, "Print JSON instead of a table");
  CLI::Option* plot = command->add_option("--plot", arguments->plot, "Also write a picture of both trajectories, SVG");
  command->add_option("--grid", arguments->grid, "Drawn below them: grid in the estimate's frame, map_server yaml")
      ->needs(plot);
  command
      ->add_option("--beside", arguments->beside,
                   "Drawn with them: another estimate, like odometry alone, aligned for itself (TUM format)")
      ->needs(plot);
  command->callback([arguments, exit_code] { *exit_code = Evaluate(*arguments); });
}

}  // namespace planar_vslam
