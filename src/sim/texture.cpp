#include "texture.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "planar_vslam/geometry/check.h"

namespace planar_vslam::sim {

Texture::Texture(const cv::Mat& pixels, TextureEdge edge) {
  const auto power_of_two = [](int n) { return n > 0 && (n & (n - 1)) == 0; };
  PV_CHECK(pixels.type() == CV_8UC1 && power_of_two(pixels.cols) && power_of_two(pixels.rows),
           pixels.cols << " x " << pixels.rows << " type " << pixels.type());
  cv::Mat level = pixels;
  while (true) {
    AddLevel(level, edge);
    if (level.cols == 1 && level.rows == 1) break;
    cv::Mat half;
    cv::resize(level, half, cv::Size(std::max(1, level.cols / 2), std::max(1, level.rows / 2)), 0, 0, cv::INTER_AREA);
    level = half;
  }
  for (Level& made : levels_) {
    made.scale_x = kOne * static_cast<float>(made.mask_x + 1) / static_cast<float>(pixels.cols);
    made.scale_y = kOne * static_cast<float>(made.mask_y + 1) / static_cast<float>(pixels.rows);
  }
}

void Texture::AddLevel(const cv::Mat& pixels, TextureEdge edge) {
  const int width = pixels.cols, height = pixels.rows;
  constexpr int kFar = 1 << 30;  // beyond every coordinate
  Level level{1.0f, 1.0f, -kFar, kFar, kFar, width - 1, height - 1, 0, quads_.size()};
  while (1 << level.stride < width) ++level.stride;
  if (edge == TextureEdge::kClamp) {
    level.low = 0, level.high_x = (width - 1) * kOne, level.high_y = (height - 1) * kOne;
  }
  const auto next = [edge](int i, int count) {
    return i + 1 < count ? i + 1 : edge == TextureEdge::kRepeat ? 0 : count - 1;
  };
  quads_.reserve(quads_.size() + pixels.total());
  for (int y = 0; y < height; ++y) {
    const std::uint8_t *upper = pixels.ptr(y), *lower = pixels.ptr(next(y, height));
    for (int x = 0; x < width; ++x) {
      const int right = next(x, width);
      quads_.push_back(static_cast<std::uint32_t>(upper[x]) | static_cast<std::uint32_t>(upper[right]) << 8 |
                       static_cast<std::uint32_t>(lower[x]) << 16 | static_cast<std::uint32_t>(lower[right]) << 24);
    }
  }
  levels_.push_back(level);
}

}  // namespace planar_vslam::sim
