#pragma once
#include <filesystem>
#include <string>

#include "planar_vslam/geometry/expected.h"

namespace planar_vslam {

// Writes a file beside `path`, waits until the disk has it, and renames it to `path`. Whatever happens meanwhile,
// `path` is the old file or the whole new one. What is there already must be a regular file.
Expected<bool> WriteFileAtomically(const std::filesystem::path& path, const std::string& bytes);

}  // namespace planar_vslam
