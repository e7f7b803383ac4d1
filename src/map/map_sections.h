#pragma once
// The content of a saved map as sections of plain bytes.
#include <array>
#include <string>

#include "planar_vslam/map/map_file.h"

namespace planar_vslam::map_file {

// In the order in which the file has them.
constexpr std::array<const char*, 4> kTags = {"CAMR", "MAPS", "KEYF", "LAND"};
using Sections = std::array<std::string, kTags.size()>;

// `map` is sound.
Sections Encode(const Map& map, const CameraModel& camera);

// Any bytes give a value or an Error; whether the map is sound is not looked at.
Expected<SavedMap> Decode(const Sections& sections);

}  // namespace planar_vslam::map_file
