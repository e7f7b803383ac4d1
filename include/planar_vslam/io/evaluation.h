#pragma once
// Trajectory errors against ground truth.
#include <filesystem>
#include <optional>
#include <string>

#include "planar_vslam/geometry/alignment.h"
#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/io/trajectory.h"
#include "planar_vslam/mapping2d/grid.h"

namespace planar_vslam {

enum class EvaluationAlignment { kNone, kSe2, kSe3, kSim3, kFirst };

struct ErrorStatistics {
  double rmse = 0.0, mean = 0.0, median = 0.0, max = 0.0;
};

struct TrajectoryErrors {
  long pairs = 0;          // estimate poses inside the truth's span, truth interpolated to their stamps
  ErrorStatistics ate;     // m, 3D
  ErrorStatistics ate_2d;  // m, x and y only
  Eigen::Vector3d ate_axis_rmse = Eigen::Vector3d::Zero();  // m, per axis of the truth frame, as in the paper
  ErrorStatistics heading;                                  // rad
  // Relative errors are not a number where the trajectory has no segment of that length, and so is the scale error of a
  // robot that did not move.
  double rpe_translation_per_meter = 0.0;   // m per m, RMSE over 1 m segments of the truth
  double rpe_rotation_per_meter = 0.0;      // rad per m
  double rpe_translation_per_second = 0.0;  // m per s, RMSE over 1 s segments
  double rpe_rotation_per_second = 0.0;     // rad per s
  double scale_error = 0.0;  // Sim(3) scale of the estimate relative to truth, minus 1 (0.01: estimate 1 % long)
  double coverage =
      0.0;  // share of the truth's span, from its first to last stamp, with estimates no more than 0.5 s apart
  Similarity3 truth_from_estimate;  // the alignment used
};

// Truth gaps over 0.5 s are not interpolated across. Needs at least 3 pairs.
Expected<TrajectoryErrors> EvaluateTrajectory(const Trajectory& estimate, const Trajectory& truth,
                                              EvaluationAlignment alignment);
// Laid over the truth by a transform that is known from elsewhere.
Expected<TrajectoryErrors> EvaluateTrajectory(const Trajectory& estimate, const Trajectory& truth,
                                              const Similarity3& truth_from_estimate);

std::string ToJson(const TrajectoryErrors& errors);
std::string ToText(const TrajectoryErrors& errors);

// What else a picture shows.
struct PlotLayers {
  std::optional<OccupancyGrid2d> grid;  // in the estimate's frame, below the trajectories
  Trajectory beside;                    // another estimate, like odometry alone; may be empty
  Similarity3 truth_from_beside;
  std::string beside_name;
};
// Top view of both trajectories (estimate aligned) with axes in metres, and the error over time below.
Expected<bool> WriteSvgPlot(const Trajectory& estimate, const Trajectory& truth, const TrajectoryErrors& errors,
                            const std::filesystem::path& path, const PlotLayers& layers = {});

}  // namespace planar_vslam
