#pragma once
// A picture of where a saved map can be localised in: the grid, and on it a star for each place, its eight rays green
// where enough landmarks are in view that way, red where not.
#include <filesystem>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/pipeline/map_coverage.h"

namespace planar_vslam {

Expected<bool> WriteCoveragePlot(const MapCoverage& coverage, const OccupancyGrid2d& grid,
                                 const std::filesystem::path& path);

}  // namespace planar_vslam
