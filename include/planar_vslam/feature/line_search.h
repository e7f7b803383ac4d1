#pragma once
// Keypoints of an image, to be asked which of them may lie on a line: those near an epipolar line, for hundreds of
// lines. They are kept in blocks of neighbours, and a line that passes a block by is compared with none in it.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "planar_vslam/feature/features.h"

namespace planar_vslam {

class LineSearch {
 public:
  // Keypoints `indices` of an image. `squared_reach[octave]` is how far (px^2) one may lie from a line that it is on.
  LineSearch(const std::vector<Keypoint>& keypoints, const std::vector<int>& indices,
             const std::vector<float>& squared_reach);

  // Appends the indices of all keypoints within their reach of the line l^T (x, y, 1) = 0, in no particular order. The
  // line's direction (its first two) is not zero.
  void Find(const Eigen::Vector3f& line, std::vector<int>* indices) const;

 private:
  static constexpr std::size_t kBlock = 16;
  // One array a coordinate, so that the compiler can compare several keypoints at once.
  struct Block {
    std::array<float, kBlock> x{}, y{};                // px
    std::array<float, kBlock> squared_reach{};         // px^2; negative where the block has no more keypoints
    std::array<std::int32_t, kBlock> index{};          // of the keypoint
    Eigen::Vector2f center = Eigen::Vector2f::Zero();  // px
    float squared_radius = 0.0F;                       // px^2, around the centre: no line beyond it reaches a keypoint
  };
  static Block MakeBlock(const std::vector<Keypoint>& keypoints, const int* begin, const int* end,
                         const std::vector<float>& squared_reach);
  std::vector<Block> blocks_;
};

}  // namespace planar_vslam
