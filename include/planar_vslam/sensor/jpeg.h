#pragma once
// JPEG in memory <-> 8-bit grey images.
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

// What is larger is not decoded: a few damaged bytes can ask for any amount of memory.
constexpr std::size_t kMaxDecodedPixels = std::size_t{1} << 27;

// The luma of grey and colour images, in the sensor's own orientation (EXIF is not read). Nothing where the bytes are
// no JPEG, end before the image does, hold more than kMaxDecodedPixels, or CMYK.
std::optional<GrayImage> DecodeJpeg(const std::vector<std::uint8_t>& bytes);

// Quality is from 1 to 100. Nothing where a side is 0 or longer than a JPEG can be, 65500 px.
std::optional<std::vector<std::uint8_t>> EncodeJpeg(const GrayImage& image, int quality);

}  // namespace planar_vslam
