#pragma once
// The bags of one drive, read as one: a recorder that splits its files writes tf_static into the first only.
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "planar_vslam/geometry/expected.h"

namespace planar_vslam::io {

using Bags = std::vector<std::unique_ptr<rosbag::Bag>>;  // not empty

// Throws what rosbag throws on broken files; an error names the file.
Expected<Bags> OpenBags(const std::vector<std::filesystem::path>& paths);
// What they are called in messages.
std::string NameOf(const std::vector<std::filesystem::path>& paths);
// The messages of all of them on these topics, in the order of recording.
void Show(const Bags& bags, const std::vector<std::string>& topics, rosbag::View* view);

}  // namespace planar_vslam::io
