#pragma once
// Procedural grey textures, drawn from a seed. Grey levels are as displayed (gamma applied).
#include <opencv2/core.hpp>

#include <cstdint>
#include <string>

namespace planar_vslam::sim {

// A square of `pixels` x `pixels` that repeats seamlessly; the side is `metres` long. `shade` is the mean grey level,
// or TextureSpec::kDefaultShade.
cv::Mat DrawSurface(const std::string& style, int shade, int pixels, double metres, std::uint64_t seed);

// A picture of width_m x height_m metres, stretched to `size` pixels.
cv::Mat DrawPicture(const std::string& style, cv::Size size, double width_m, double height_m, std::uint64_t seed);

// Smooth random field of about +-1 with features of side / `cells` pixels that repeats at the borders.
cv::Mat RepeatingNoise(cv::Size size, int cells_x, int cells_y, cv::RNG& random);

}  // namespace planar_vslam::sim
