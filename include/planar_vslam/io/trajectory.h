#pragma once
// TUM-format trajectories: `t x y z qx qy qz qw` a line, # comments.
#include <filesystem>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/geometry/rigid3.h"
#include "planar_vslam/sensor/timestamp.h"

namespace planar_vslam {

struct StampedPose {
  Timestamp stamp;
  Rigid3 T_map_base;
};
using Trajectory = std::vector<StampedPose>;

// Ascending stamps are required; errors name file and line. Numbers are written so that reading gives them back:
// stamps with 9 decimals, poses with 9.
Expected<Trajectory> ReadTrajectory(const std::filesystem::path& path);
Expected<bool> WriteTrajectory(const Trajectory& trajectory, const std::filesystem::path& path);

}  // namespace planar_vslam
