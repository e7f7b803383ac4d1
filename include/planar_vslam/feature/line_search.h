#pragma once
// Keypoints of an image, to be asked which of them may lie on a line: those near an epipolar line, for hundreds of
// lines. They are kept in blocks of neighbours, and a line that passes a block by is compared with none in it. Several
// are compared at once, and nothing branches on one comparison: no processor foresees where a line goes.
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
  static constexpr std::size_t kLanes = 8;
  using Lanes = std::array<float, kLanes>;
  struct Keypoints {
    Lanes x{}, y{};         // px
    Lanes squared_reach{};  // px^2; negative where there is no keypoint
    std::array<std::int32_t, kLanes> index{};
  };
  static constexpr std::size_t kParts = 2;
  using Block = std::array<Keypoints, kParts>;
  // The boxes around the keypoints of so many blocks. A line that stays off by more than `reach` is near none of them.
  struct Boxes {
    Lanes x{}, y{};                     // px, centre
    Lanes half_width{}, half_height{};  // px
    Lanes reach{};                      // px; far below zero where there is no block
  };

  void Add(const std::vector<Keypoint>& keypoints, const int* begin, const int* end,
           const std::vector<float>& squared_reach);
  void SetBox(const Eigen::Vector2f& lower, const Eigen::Vector2f& upper, float squared_reach);

  std::vector<Block> blocks_;
  std::vector<Boxes> boxes_;
};

}  // namespace planar_vslam
