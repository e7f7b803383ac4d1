#pragma once
// FAST corners of one pyramid level with a threshold that adapts to the texture of each cell.
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/core/types.hpp>
#include <vector>

#include "corner_kernel.h"

namespace planar_vslam {

struct Corner {
  int x = 0;  // px of the level
  int y = 0;
  float response = 0.0F;  // FAST score: the largest threshold at which it still is a corner
};

struct CornerThresholds {
  int high = 0;         // grey levels, at most 254; used wherever a cell has such a corner
  int low = 0;          // grey levels; used in the other cells
  int cell_pixels = 0;  // side of a cell
};

class CornerDetector {
 public:
  static constexpr int kMargin = kCircleRadius + 1;                       // px; suppression looks one pixel further
  static constexpr int kMinColumns = kContrastBlock + 2 * kCircleRadius;  // px

  explicit CornerDetector(InstructionSet set) : kernel_(CornerKernelOf(set)) {}
  // Local maxima of the FAST score inside `inner`, which keeps kMargin or more from the border of `level`, of
  // kMinColumns or more: those of the high threshold, row by row, then those of the low one, cell by cell.
  void Detect(const cv::Mat& level, const cv::Rect& inner, const CornerThresholds& thresholds,
              std::vector<Corner>* corners);

 private:
  // What is known of one row of the image: the contrast of its pixels and the blocks that hold corners.
  struct Row {
    std::vector<std::uint8_t> contrast;
    std::vector<int> blocks;
    int block_count = 0;
  };
  void DetectInside(const cv::Mat& level, const cv::Rect& area, int threshold, std::vector<Corner>* corners);
  void AppendPeaks(const cv::Rect& area, int y, std::vector<Corner>* corners);
  const Row& RowAt(int y) const { return rows_[static_cast<std::size_t>(y) % rows_.size()]; }

  CornerKernel kernel_;
  std::array<Row, 3> rows_;             // of the last three y
  std::vector<std::uint32_t> peaks_;    // of each block of one of them
  std::vector<std::uint8_t> occupied_;  // one for each cell, row by row
};

}  // namespace planar_vslam
