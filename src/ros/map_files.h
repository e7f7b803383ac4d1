#pragma once
// Files that services name: all of them below ~map_directory.
#include <filesystem>
#include <string>

#include "parameters.h"
#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/pipeline/estimator.h"

namespace planar_vslam::ros_face {

// `name`.`extension` below `directory`, whether or not `name` ends so; names that lead out of it, also by a link, are
// an Error.
Expected<std::filesystem::path> ResolveMapName(const std::filesystem::path& directory, const std::string& name,
                                               const std::string& extension);

OccupancyGrid2d BuildGrid(const EstimatorSnapshot& snapshot, const PipelineOptions& options);

// Writes grid and map as `name`.yaml, .pgm and .pvm; the path of the .yaml.
Expected<std::filesystem::path> SaveMapFiles(const EstimatorSnapshot& snapshot, const NodeSettings& settings,
                                             const std::string& name);

}  // namespace planar_vslam::ros_face
