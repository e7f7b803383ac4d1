#pragma once
// PNG in memory -> 8-bit grey.
#include <cstdint>
#include <optional>
#include <vector>

#include "planar_vslam/io/grey_depth.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam::io {

// Grey of 16 bits by the depth of its stream, of other 16 bits the high byte, of colours 0.299 r + 0.587 g + 0.114 b;
// transparency is not applied. Nothing where the bytes are no PNG, are damaged or too few, or hold more than
// kMaxDecodedPixels.
std::optional<GrayImage> DecodePng(const std::vector<std::uint8_t>& bytes, GreyDepth* depth);

}  // namespace planar_vslam::io
