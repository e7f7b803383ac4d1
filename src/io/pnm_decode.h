#pragma once
// Binary PGM and PPM (P5, P6) in memory -> 8-bit grey.
#include <cstdint>
#include <optional>
#include <vector>

#include "planar_vslam/io/grey_depth.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam::io {

// Grey of 16 bits by the depth of its stream, of other 16 bits the high byte, of colours 0.299 r + 0.587 g + 0.114 b;
// values are not scaled to the greatest one that the header names. Nothing where the bytes are neither, are too few, or
// hold more than kMaxDecodedPixels.
std::optional<GrayImage> DecodePnm(const std::vector<std::uint8_t>& bytes, GreyDepth* depth);

}  // namespace planar_vslam::io
