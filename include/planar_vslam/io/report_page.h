#pragma once
// One HTML page of what a run left in its folder: pictures as inline SVG, no script, nothing from the network, light or
// dark as the reader's screen is.
#include <filesystem>
#include <optional>

#include "planar_vslam/geometry/expected.h"

namespace planar_vslam {

struct ReportInput {
  std::filesystem::path folder;                   // as `run --out` filled it
  std::optional<std::filesystem::path> truth;     // TUM trajectory, aligned on the plane
  std::optional<std::filesystem::path> odometry;  // TUM trajectory; laid on the first pose of the run
};

// Needs report.json, status.csv and trajectory.txt; draws the grid, keyframes and covariances where they are. Errors
// name the file.
Expected<bool> WriteReportPage(const ReportInput& input, const std::filesystem::path& page);

}  // namespace planar_vslam
