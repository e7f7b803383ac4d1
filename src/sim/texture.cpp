#include "texture.h"

#include <algorithm>
#include <cstring>
#include <opencv2/imgproc.hpp>

#include "planar_vslam/geometry/check.h"

namespace planar_vslam::sim {
namespace {

// Lookups work in whole numbers: positions in 1/256 px, values in 1/65536 grey levels. No floor(), no conversions in
// the inner loop, and far more exact than 8-bit textures need.
constexpr int kFractionBits = 8;
constexpr int kOne = 1 << kFractionBits;
constexpr float kValueUnit = 1.0f / (kOne * kOne);

}  // namespace

Texture::Texture(const cv::Mat& pixels, TextureEdge edge) : edge_(edge) {
  const auto power_of_two = [](int n) { return n > 0 && (n & (n - 1)) == 0; };
  PV_CHECK(pixels.type() == CV_8UC1 && power_of_two(pixels.cols) && power_of_two(pixels.rows),
           pixels.cols << " x " << pixels.rows << " type " << pixels.type());
  cv::Mat level = pixels;
  while (true) {
    const float scale_x = kOne * static_cast<float>(level.cols) / static_cast<float>(pixels.cols);
    const float scale_y = kOne * static_cast<float>(level.rows) / static_cast<float>(pixels.rows);
    levels_.push_back({level.cols, level.rows, scale_x, scale_y, pixels_.size()});
    for (int y = 0; y < level.rows; ++y) pixels_.insert(pixels_.end(), level.ptr(y), level.ptr(y) + level.cols);
    if (level.cols == 1 && level.rows == 1) break;
    cv::Mat half;
    cv::resize(level, half, cv::Size(std::max(1, level.cols / 2), std::max(1, level.rows / 2)), 0, 0, cv::INTER_AREA);
    level = half;
  }
}

inline int Texture::Bilinear(const Level& level, float x, float y) const {
  constexpr float kBias = static_cast<float>(kOne) * 16.0f;  // keeps what is truncated positive a little left of 0
  const int px = static_cast<int>(x * level.scale_x + kBias) - static_cast<int>(kBias) - kOne / 2;
  const int py = static_cast<int>(y * level.scale_y + kBias) - static_cast<int>(kBias) - kOne / 2;
  const int ax = px & (kOne - 1), ay = py & (kOne - 1);
  int x0 = px >> kFractionBits, y0 = py >> kFractionBits, x1 = x0 + 1, y1 = y0 + 1;
  if (edge_ == TextureEdge::kRepeat) {
    x0 &= level.width - 1, x1 &= level.width - 1, y0 &= level.height - 1, y1 &= level.height - 1;
  } else {
    x0 = std::clamp(x0, 0, level.width - 1), x1 = std::clamp(x1, 0, level.width - 1);
    y0 = std::clamp(y0, 0, level.height - 1), y1 = std::clamp(y1, 0, level.height - 1);
  }
  const std::uint8_t* pixels = pixels_.data() + level.offset;
  const std::uint8_t* row0 = pixels + static_cast<std::ptrdiff_t>(y0) * level.width;
  const std::uint8_t* row1 = pixels + static_cast<std::ptrdiff_t>(y1) * level.width;
  const int top = (row0[x0] << kFractionBits) + ax * (row0[x1] - row0[x0]);
  const int bottom = (row1[x0] << kFractionBits) + ax * (row1[x1] - row1[x0]);
  return (top << kFractionBits) + ay * (bottom - top);
}

float Texture::Sample(float x, float y, float footprint) const {
  if (!(footprint > 1.0f)) return kValueUnit * static_cast<float>(Bilinear(levels_.front(), x, y));
  // log2 by the number's own exponent and mantissa (IEEE 754): the mantissa is at most 0.09 off, unnoticeable here.
  std::uint32_t bits = 0;
  std::memcpy(&bits, &footprint, sizeof bits);
  const std::size_t level = (bits >> 23) - 127;
  const float between = static_cast<float>(bits & 0x7fffff) / static_cast<float>(1 << 23);
  if (level + 1 >= levels_.size()) return static_cast<float>(pixels_.back());
  const auto fine = static_cast<float>(Bilinear(levels_[level], x, y));
  const auto coarse = static_cast<float>(Bilinear(levels_[level + 1], x, y));
  return kValueUnit * (fine + between * (coarse - fine));
}

}  // namespace planar_vslam::sim
