#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "commands.h"
#include "planar_vslam/io/evaluation.h"
#include "planar_vslam/io/trajectory.h"
#include "planar_vslam/mapping2d/grid_score.h"

namespace planar_vslam {
namespace {

constexpr int kLargestTolerance = 100;   // cells; beyond it everything is near everything
constexpr double kLongestSight = 100.0;  // m

struct GridScoreArguments {
  std::string map, groundtruth, trajectory, groundtruth_trajectory;
  std::vector<double> transform;  // T_truth_estimate: x m, y m, yaw rad
  GridScoreOptions options;
  bool json = false;
};

// Where the estimate's grid lies on the truth's, and the path from which free space must be reachable.
struct Placement {
  Rigid2 T_truth_estimate;
  std::vector<Eigen::Vector2d> path;
};

Expected<Placement> Place(const GridScoreArguments& arguments) {
  Placement placement;
  if (!arguments.transform.empty()) {
    const std::vector<double>& t = arguments.transform;
    const bool finite = std::isfinite(t[0]) && std::isfinite(t[1]) && std::isfinite(t[2]);
    if (!finite) return Error{"--transform: expected three finite numbers x,y,yaw"};
    placement.T_truth_estimate = Rigid2(t[0], t[1], t[2]);
  }
  if (arguments.groundtruth_trajectory.empty()) return placement;
  const Expected<Trajectory> truth = ReadTrajectory(arguments.groundtruth_trajectory);
  if (!truth) return truth.error();
  for (const StampedPose& pose : *truth) placement.path.emplace_back(pose.T_map_base.translation.head<2>());
  if (arguments.trajectory.empty()) return placement;
  const Expected<Trajectory> estimate = ReadTrajectory(arguments.trajectory);
  if (!estimate) return estimate.error();
  const Expected<TrajectoryErrors> errors = EvaluateTrajectory(*estimate, *truth, EvaluationAlignment::kSe2);
  if (!errors) return Error{arguments.trajectory + ": " + errors.error().message};
  placement.T_truth_estimate = ProjectToPlane(errors->truth_from_estimate.T_target_source);
  return placement;
}

std::string ToJson(const GridScore& score) {
  return fmt::format(
      "{{\"iou\": {:.6f}, \"precision\": {:.6f}, \"recall\": {:.6f}, \"in_sight\": {:.6f}, \"wrong_free\": {:.6f}, "
      "\"wrong_occupied\": {:.6f}, \"known\": {:.6f}, \"our_occupied\": {}, \"our_free\": {}, "
      "\"truth_surface\": {}, \"truth_reachable_free\": {}}}\n",
      score.iou, score.precision, score.recall, score.in_sight, score.wrong_free, score.wrong_occupied, score.known,
      score.our_occupied, score.our_free, score.truth_surface, score.truth_reachable_free);
}

std::string ToText(const GridScore& score, const GridScoreOptions& options) {
  const int tolerance = options.tolerance_cells;
  return fmt::format(
      "iou             {:.4f}   occupied cells, exact\n"
      "precision       {:.4f}   of {} occupied cells, a truly occupied one within {}\n"
      "recall          {:.4f}   of {} true surface cells, one of ours within {}\n"
      "in sight        {:.4f}   of the path within {} m: a perfect range sensor's recall\n"
      "wrong-free      {:.4f}   of {} free cells, inside an obstacle\n"
      "wrong-occupied  {:.4f}   of the occupied cells, none truly occupied within 3\n"
      "known           {:.4f}   of {} reachable free cells, called free or occupied\n",
      score.iou, score.precision, score.our_occupied, tolerance, score.recall, score.truth_surface, tolerance,
      score.in_sight, options.sight_range, score.wrong_free, score.our_free, score.wrong_occupied, score.known,
      score.truth_reachable_free);
}

int Score(const GridScoreArguments& arguments) {
  const Expected<OccupancyGrid2d> map = ReadMapServerFiles(arguments.map);
  if (!map) return Fail(kExitBadInput, map.error().message);
  const Expected<OccupancyGrid2d> truth = ReadMapServerFiles(arguments.groundtruth);
  if (!truth) return Fail(kExitBadInput, truth.error().message);
  const Expected<Placement> placement = Place(arguments);
  if (!placement) return Fail(kExitBadInput, placement.error().message);
  const GridScore score = ScoreGrid(*map, *truth, placement->T_truth_estimate, placement->path, arguments.options);
  std::fputs((arguments.json ? ToJson(score) : ToText(score, arguments.options)).c_str(), stdout);
  return kExitSuccess;
}

}  // namespace

void AddGridScore(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<GridScoreArguments>();
  CLI::App* command = app.add_subcommand("grid-score", "How well an occupancy grid agrees with a true one");
  command->add_option("--map", arguments->map, "Grid to score, map_server yaml")->required();
  command->add_option("--groundtruth", arguments->groundtruth, "True grid, map_server yaml")->required();
  CLI::Option* transform =
      command->add_option("--transform", arguments->transform, "x,y,yaw (m, rad): from the map's frame to the truth's")
          ->delimiter(',')
          ->expected(3);
  CLI::Option* groundtruth_trajectory =
      command->add_option("--groundtruth-trajectory", arguments->groundtruth_trajectory,
                          "True trajectory, TUM format: 'known' asks for the free cells reachable from it, "
                          "'in sight' for the surfaces it saw");
  command
      ->add_option("--trajectory", arguments->trajectory,
                   "Trajectory of the map, TUM format: its SE(2) alignment with the true one places the map")
      ->needs(groundtruth_trajectory)
      ->excludes(transform);
  command->add_option("--tolerance", arguments->options.tolerance_cells, "Cells of the truth that count as near")
      ->capture_default_str()
      ->check(CLI::Range(0, kLargestTolerance));
  command->add_option("--sight-range", arguments->options.sight_range, "m, how far the true trajectory sees")
      ->capture_default_str()
      ->check(CLI::Range(0.1, kLongestSight));
  command->add_flag("--json", arguments->json, "Print JSON instead of a table");
  command->callback([arguments, exit_code] { *exit_code = Score(*arguments); });
}

}  // namespace planar_vslam
