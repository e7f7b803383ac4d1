#pragma once
// An 8-bit texture with a mip pyramid: lookups average over about the area a pixel sees (L. Williams, "Pyramidal
// parametrics", SIGGRAPH 1983).
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace planar_vslam::sim {

enum class TextureEdge { kRepeat, kClamp };

class Texture {
 public:
  // Positions are whole numbers of 1 / kOne px: no floor() in the inner loop, and far more exact than 8 bits need.
  static constexpr int kFractionBits = 8;
  static constexpr int kOne = 1 << kFractionBits;

  // Sides must be powers of two.
  Texture(const cv::Mat& pixels, TextureEdge edge);

  // Coordinates are in pixels of the finest level, pixel (i, j) covering [i, i+1) x [j, j+1). A lookup scales them to
  // the level, takes off half a pixel, clamps to [low, high] and splits whole and fraction; the whole part, masked, is
  // the index of a quad: the pixels at (x, y), (x+1, y), (x, y+1), (x+1, y+1) from the lowest byte up.
  struct Level {
    float scale_x, scale_y;      // in 1 / kOne px
    int low, high_x, high_y;     // in 1 / kOne px
    int mask_x, mask_y, stride;  // stride: log2 of the quads in a row
    std::size_t offset;          // of the first quad
  };
  const std::vector<Level>& levels() const { return levels_; }
  const std::uint32_t* quads(const Level& level) const { return quads_.data() + level.offset; }
  int width() const { return levels_.front().mask_x + 1; }
  int height() const { return levels_.front().mask_y + 1; }

 private:
  void AddLevel(const cv::Mat& pixels, TextureEdge edge);

  std::vector<Level> levels_;
  std::vector<std::uint32_t> quads_;
};

}  // namespace planar_vslam::sim
