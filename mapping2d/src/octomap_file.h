#pragma once
// The only header that knows OctoMap: voxels to its trees and files.
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/mapping2d/map_builder.h"
#include "voxels.h"

namespace planar_vslam {

struct OctomapVoxel {
  VoxelIndex at;
  float log_odds = 0.0F;
};

// Full tree with log-odds where the name ends in .ot, else the binary one.
Expected<bool> WriteOctomapFile(const std::vector<OctomapVoxel>& voxels, double resolution, double occupied_threshold,
                                const std::filesystem::path& path);

// What such a file has after its text header.
std::string OctomapStream(const std::vector<OctomapVoxel>& voxels, double resolution, double occupied_threshold,
                          OctomapForm form);

// The occupied leaves of the pruned maximum likelihood tree.
std::vector<OccupiedCube> OccupiedLeaves(const std::vector<OctomapVoxel>& voxels, double resolution,
                                         double occupied_threshold);

}  // namespace planar_vslam
