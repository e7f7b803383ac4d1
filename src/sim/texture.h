#pragma once
// An 8-bit texture with a mip pyramid: lookups average over about the area a pixel sees.
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace planar_vslam::sim {

enum class TextureEdge { kRepeat, kClamp };

class Texture {
 public:
  // Sides must be powers of two.
  Texture(const cv::Mat& pixels, TextureEdge edge);

  int width() const { return levels_.front().width; }
  int height() const { return levels_.front().height; }
  // Grey value at (x, y), where pixel (i, j) covers [i, i+1) x [j, j+1), seen with a footprint of `footprint` pixels:
  // trilinear (L. Williams, "Pyramidal parametrics", SIGGRAPH 1983). Coordinates within +-2^20.
  float Sample(float x, float y, float footprint) const;

 private:
  struct Level {
    int width, height;
    float scale_x, scale_y;  // from coordinates of the finest level to this one's, in 1 / 256 px
    std::size_t offset;      // of its first pixel
  };
  int Bilinear(const Level& level, float x, float y) const;

  TextureEdge edge_;
  std::vector<Level> levels_;
  std::vector<std::uint8_t> pixels_;
};

}  // namespace planar_vslam::sim
