#include "texture.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>

#include "planar_vslam/geometry/check.h"

namespace planar_vslam::sim {

Texture::Texture(const cv::Mat& pixels, TextureEdge edge) : edge_(edge) {
  const auto power_of_two = [](int n) { return n > 0 && (n & (n - 1)) == 0; };
  PV_CHECK(pixels.type() == CV_8UC1 && power_of_two(pixels.cols) && power_of_two(pixels.rows),
           pixels.cols << " x " << pixels.rows << " type " << pixels.type());
  cv::Mat level = pixels;
  while (true) {
    levels_.push_back({level.cols, level.rows, pixels_.size()});
    for (int y = 0; y < level.rows; ++y) pixels_.insert(pixels_.end(), level.ptr(y), level.ptr(y) + level.cols);
    if (level.cols == 1 && level.rows == 1) break;
    cv::Mat half;
    cv::resize(level, half, cv::Size(std::max(1, level.cols / 2), std::max(1, level.rows / 2)), 0, 0, cv::INTER_AREA);
    level = half;
  }
}

float Texture::Bilinear(const Level& level, float x, float y) const {
  const float fx = x - 0.5f, fy = y - 0.5f;
  const float floor_x = std::floor(fx), floor_y = std::floor(fy);
  const float ax = fx - floor_x, ay = fy - floor_y;
  int x0 = static_cast<int>(floor_x), y0 = static_cast<int>(floor_y), x1 = x0 + 1, y1 = y0 + 1;
  if (edge_ == TextureEdge::kRepeat) {
    x0 &= level.width - 1, x1 &= level.width - 1, y0 &= level.height - 1, y1 &= level.height - 1;
  } else {
    x0 = std::clamp(x0, 0, level.width - 1), x1 = std::clamp(x1, 0, level.width - 1);
    y0 = std::clamp(y0, 0, level.height - 1), y1 = std::clamp(y1, 0, level.height - 1);
  }
  const std::uint8_t* pixels = pixels_.data() + level.offset;
  const std::uint8_t* row0 = pixels + static_cast<std::ptrdiff_t>(y0) * level.width;
  const std::uint8_t* row1 = pixels + static_cast<std::ptrdiff_t>(y1) * level.width;
  const float top = static_cast<float>(row0[x0]) + ax * static_cast<float>(row0[x1] - row0[x0]);
  const float bottom = static_cast<float>(row1[x0]) + ax * static_cast<float>(row1[x1] - row1[x0]);
  return top + ay * (bottom - top);
}

float Texture::Sample(float x, float y, float footprint) const {
  if (footprint <= 1.0f) return Bilinear(levels_.front(), x, y);
  // log2 without the logarithm: exponent, then the mantissa's distance from 1 (at most 0.09 off, unnoticeable here).
  const int exponent = std::ilogb(footprint);
  const auto coarsest = static_cast<int>(levels_.size()) - 1;
  const float scale = std::ldexp(1.0f, -exponent);
  const float between = footprint * scale - 1.0f;
  if (exponent >= coarsest) return static_cast<float>(pixels_.back());
  const Level& fine = levels_[static_cast<std::size_t>(exponent)];
  const Level& coarse = levels_[static_cast<std::size_t>(exponent) + 1];
  // A narrow texture's short side stops halving at one pixel: scale each axis by its own level size.
  const float to_fine_x = static_cast<float>(fine.width) / static_cast<float>(width());
  const float to_fine_y = static_cast<float>(fine.height) / static_cast<float>(height());
  const float to_coarse_x = static_cast<float>(coarse.width) / static_cast<float>(width());
  const float to_coarse_y = static_cast<float>(coarse.height) / static_cast<float>(height());
  const float a = Bilinear(fine, x * to_fine_x, y * to_fine_y);
  const float b = Bilinear(coarse, x * to_coarse_x, y * to_coarse_y);
  return a + between * (b - a);
}

}  // namespace planar_vslam::sim
