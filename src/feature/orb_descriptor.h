#pragma once
// Orientation and descriptor of OpenCV's ORB at a pixel of one pyramid level, bit for bit.
#include <array>
#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>

#include "planar_vslam/feature/features.h"

namespace planar_vslam {

// Pixels a keypoint needs on each side: the corners of the sampling square reach 18.4 px when rotated.
constexpr int kOrbMargin = 19;  // px

// Direction of the intensity centroid of the disc of radius 15 px (Rublee et al., Sec. 3.2).
class PatchOrientation {
 public:
  PatchOrientation();
  // Degrees in [0, 360). `level` is the image as it is, not blurred.
  float Degrees(const cv::Mat& level, int x, int y) const;

 private:
  static constexpr int kRadius = 15;             // px
  static constexpr int kSide = 2 * kRadius + 1;  // px
  static constexpr int kStride = kSide + 1;      // one column of zeros makes rows a multiple of 8
  using Row = std::array<std::int16_t, kStride>;
  std::array<Row, kSide> mask_{};      // 1 inside the disc
  std::array<Row, kSide> weighted_{};  // column offset inside the disc
};

// The 256 pairs of points whose brightness ORB compares. OpenCV keeps its table to itself, so it is asked: an image
// with one dark or bright pixel at a known offset from a keypoint flips exactly the bits that look there.
class BriefPattern {
 public:
  static constexpr std::size_t kPairs = 256;
  BriefPattern();
  // Rotates the pattern by `angle` rad and compares the pixels of `blurred` around (x, y).
  Descriptor Describe(const cv::Mat& blurred, int x, int y, float angle) const;

 private:
  // Offsets from the keypoint, px: the first points of all pairs, then the second points.
  std::array<float, 2 * kPairs> x_{};
  std::array<float, 2 * kPairs> y_{};
};

// The smoothing ORB applies to a level before it describes it.
void BlurForBrief(const cv::Mat& level, cv::Mat* blurred);

}  // namespace planar_vslam
