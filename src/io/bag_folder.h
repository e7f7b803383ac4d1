#pragma once
// A folder of ROS 2's recorder: metadata.yaml, which a recorder that was stopped hard leaves out, and the bags.
#include <filesystem>
#include <vector>

#include "planar_vslam/geometry/expected.h"

namespace planar_vslam::io {

// Whether the recorder compressed it as a whole: x.mcap.zstd.
bool IsPackedBag(const std::filesystem::path& path);
// Whether it is a folder that holds a recording of ROS 2.
bool IsBagFolder(const std::filesystem::path& path);
// The bags of such a folder in the order of recording; a path that is no folder itself. What was compressed as a whole
// and unpacked since counts unpacked only.
Expected<std::vector<std::filesystem::path>> BagsOfPath(const std::filesystem::path& path);

}  // namespace planar_vslam::io
