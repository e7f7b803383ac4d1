#pragma once
// What `map info --coverage` adds.
#include <filesystem>
#include <string>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/map/map_file.h"
#include "planar_vslam/pipeline/map_coverage.h"
#include "planar_vslam/pipeline/options.h"

namespace planar_vslam {

// Of a metric map, over the grid that `options` make of it; drawn into `picture`.
Expected<MapCoverage> DrawCoverage(const SavedMap& saved, const PipelineOptions& options,
                                   const std::filesystem::path& picture);

std::string TextOf(const MapCoverage& coverage);
std::string JsonOf(const MapCoverage& coverage);

}  // namespace planar_vslam
