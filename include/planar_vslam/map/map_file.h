#pragma once
// The saved map: everything a Map holds, to the last bit, and the camera its keypoints were made with.
//
// All numbers are little endian, integers of fixed width, floats and doubles IEEE 754.
//   file     "PVMAP\r\n" and a byte 0x1A, version u32, then the sections CAMR, MAPS, KEYF, LAND, SCAN in this order
//            (version 1 has no SCAN, the laser sweeps; up to version 2 CAMR has no lens but plumb_bob)
//   section  tag 4 bytes, stored length u64, plain length u64, CRC-32 u32 (zlib's, of the tag, both lengths and the
//            stored bytes), stored bytes: a zstd frame, or the plain bytes themselves where both lengths are equal
// src/map/map_sections.cpp lists the fields inside each section. The same map gives the same bytes.
#include <filesystem>
#include <string>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/map/map.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam {

struct SavedMap {
  Map map;
  CameraModel camera;
};

// Replaces `path` at once when everything has reached the disk: a crash leaves the old file or the new one. Refuses a
// map or camera that LoadMapFile would refuse.
Expected<bool> SaveMapFile(const Map& map, const CameraModel& camera, const std::filesystem::path& path);

// A sound map and a usable camera, or an Error that names the file and what was expected in it. Memory stays in
// proportion to the size of the file, whatever lengths and counts it claims.
Expected<SavedMap> LoadMapFile(const std::filesystem::path& path);

// Everything that keeps LoadMapFile from loading the file, one line each; empty when nothing does.
std::vector<std::string> MapFileProblems(const std::filesystem::path& path);

}  // namespace planar_vslam
