#pragma once
// The content of a saved map as sections of plain bytes.
#include <array>
#include <string>

#include "planar_vslam/map/map_file.h"

namespace planar_vslam::map_file {

// In the order in which the file has them.
constexpr std::array<const char*, 5> kTags = {"CAMR", "MAPS", "KEYF", "LAND", "SCAN"};
using Sections = std::array<std::string, kTags.size()>;
// Version 1 of the file ends before the laser sweeps.
constexpr std::size_t kTagsOfVersion1 = 4;

// `map` is sound.
Sections Encode(const Map& map, const CameraModel& camera);

// Any bytes give a value or an Error; whether the map is sound is not looked at. Sections from `count` on do not exist.
Expected<SavedMap> Decode(const Sections& sections, std::size_t count);

}  // namespace planar_vslam::map_file
