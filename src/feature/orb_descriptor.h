#pragma once
// Orientation and descriptor of OpenCV's ORB at a pixel of one pyramid level, bit for bit.
#include <array>
#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>

#include "planar_vslam/feature/features.h"
#include "planar_vslam/feature/instruction_set.h"

namespace planar_vslam {

// Pixels a keypoint needs on each side: the corners of the sampling square reach 18.4 px when rotated.
constexpr int kOrbMargin = 19;  // px
// How far from a keypoint, in x and y, its descriptor looks.
constexpr int kOrbReach = kOrbMargin - 1;  // px

// Direction of the intensity centroid of the disc of radius 15 px (Rublee et al., Sec. 3.2).
class PatchOrientation {
 public:
  explicit PatchOrientation(InstructionSet set);
  // Degrees in [0, 360). `level` is the image as it is, not blurred; (x, y) keeps kOrbMargin from its border.
  float Degrees(const cv::Mat& level, int x, int y) const;

  static constexpr int kRadius = 15;             // px
  static constexpr int kSide = 2 * kRadius + 1;  // px
  static constexpr int kStride = kSide + 1;      // one column of zeros makes a row 32 weights
  struct Moments {
    int x = 0, y = 0;  // sums of brightness times offset from the centre
  };
  template <class Weight>
  using Rows = std::array<std::array<Weight, kStride>, kSide>;
  // For each pixel of the square around the centre: whether it is inside the disc, and its column offset if so.
  template <class Weight>
  struct Disc {
    alignas(32) Rows<Weight> inside{};
    alignas(32) Rows<Weight> column{};
  };

 private:
  InstructionSet set_;
  Disc<std::int16_t> wide_;
  Disc<std::int8_t> narrow_;  // the same
};

// The 256 pairs of points whose brightness ORB compares. OpenCV keeps its table to itself, so it is asked: an image
// with one dark or bright pixel at a known offset from a keypoint flips exactly the bits that look there.
class BriefPattern {
 public:
  static constexpr std::size_t kPairs = 256;
  // Offsets from the keypoint, px: the first points of all pairs, then the second points.
  struct Points {
    alignas(32) std::array<float, 2 * kPairs> x{};
    alignas(32) std::array<float, 2 * kPairs> y{};
  };

  explicit BriefPattern(InstructionSet set);
  // Rotates the pattern by `angle` rad and compares the pixels of `blurred` around (x, y).
  Descriptor Describe(const cv::Mat& blurred, int x, int y, float angle) const;

 private:
  InstructionSet set_;
  Points points_;
};

}  // namespace planar_vslam
