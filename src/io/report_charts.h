#pragma once
// The pictures of the report page.
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/io/consistency.h"
#include "planar_vslam/io/trajectory.h"
#include "planar_vslam/mapping2d/grid.h"

namespace planar_vslam::io {

// How far off a source of scale says that the map is, and how well it knows.
struct ScalePoint {
  double driven = 0.0, off = 0.0, sigma = 0.0;  // m, %, %
};

struct RunPicture {
  Trajectory trajectory, live, keyframes;
  Trajectory truth, odometry;  // in the map's frame; may be empty
  std::optional<OccupancyGrid2d> grid;
  std::vector<StampedCovariance> covariances;
  std::vector<std::pair<Timestamp, Timestamp>> by_sight;   // stretches in which the pose was found by sight
  std::vector<Timestamp> loops;                            // keyframes that closed one
  std::vector<ScalePoint> together, wheels, laser, floor;  // scale, by all its sources and by each
};

// Each one <svg>; empty where there is nothing to draw.
std::string TopViewChart(const RunPicture& run);
std::string PoseCharts(const RunPicture& run);  // x, y, z and yaw over time
std::string CovarianceChart(const RunPicture& run);
std::string ScaleChart(const RunPicture& run);  // over the distance driven

}  // namespace planar_vslam::io
