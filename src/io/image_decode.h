#pragma once
// Encoded and raw images -> 8-bit grey.
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/io/grey_depth.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam::io {

constexpr char kImageFormats[] = "JPEG, PNG, binary PGM or PPM";  // those that are read

// An image file in memory, in the sensor's own orientation (EXIF turns would not match the intrinsics); nothing when it
// cannot be decoded. `depth` is that of its stream.
std::optional<GrayImage> DecodeImage(const std::vector<std::uint8_t>& bytes, GreyDepth* depth);

// The same of a file.
std::optional<GrayImage> DecodeImageFile(const std::filesystem::path& path, GreyDepth* depth);

// Rows of a sensor_msgs/Image.
struct RawImage {
  int width = 0;
  int height = 0;
  std::size_t row_bytes = 0;
  std::string encoding;
  bool big_endian = false;
  const std::vector<std::uint8_t>* data = nullptr;
};

// An error names the encoding or the missing bytes. `depth` is that of its stream.
Expected<GrayImage> ConvertImage(const RawImage& raw, GreyDepth* depth);

}  // namespace planar_vslam::io
