#pragma once
// The content of a saved map as sections of plain bytes.
#include <array>
#include <cstdint>
#include <string>

#include "planar_vslam/map/map_file.h"

namespace planar_vslam::map_file {

// In the order in which the file has them.
constexpr std::array<const char*, 5> kTags = {"CAMR", "MAPS", "KEYF", "LAND", "SCAN"};
using Sections = std::array<std::string, kTags.size()>;
// Version 1 of the file ends before the laser sweeps, and up to version 2 every lens is a plumb_bob.
constexpr std::uint32_t kVersionWithoutLaser = 1, kVersionWithoutLens = 2;

// `map` is sound.
Sections Encode(const Map& map, const CameraModel& camera);

// Of a file of this version. Any bytes give a value or an Error; whether the map is sound is not looked at.
Expected<SavedMap> Decode(const Sections& sections, std::uint32_t version);

}  // namespace planar_vslam::map_file
