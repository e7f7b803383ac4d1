#pragma once
// rosbag_storage trusts the lengths and offsets inside a bag and reads out of bounds where a file is damaged. This
// walks the records first (format: wiki.ros.org/Bags/Format/2.0).
#include <filesystem>
#include <optional>

#include "planar_vslam/geometry/expected.h"

namespace planar_vslam::io {

// An error unless the file is a closed, unencrypted rosbag v2 whose records lie inside one another as they should.
std::optional<Error> CheckBag(const std::filesystem::path& path);

}  // namespace planar_vslam::io
