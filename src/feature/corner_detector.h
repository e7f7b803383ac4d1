#pragma once
// FAST corners of one pyramid level with a threshold that adapts to the texture of each cell.
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/core/types.hpp>
#include <vector>

namespace planar_vslam {

struct Corner {
  int x = 0;  // px of the level
  int y = 0;
  float response = 0.0F;  // FAST score: the largest threshold at which it still is a corner
};

struct CornerThresholds {
  int high = 0;         // grey levels; used wherever a cell has such a corner
  int low = 0;          // grey levels; used in the other cells
  int cell_pixels = 0;  // side of a cell
};

class CornerDetector {
 public:
  // Local maxima of the FAST score inside `inner`, which keeps 4 px or more from the border of `level`.
  void Detect(const cv::Mat& level, const cv::Rect& inner, const CornerThresholds& thresholds,
              std::vector<Corner>* corners);

 private:
  void DetectInside(const cv::Mat& level, const cv::Rect& area, int threshold, std::vector<Corner>* corners);

  std::vector<cv::KeyPoint> found_;
  std::vector<std::uint8_t> occupied_;  // one for each cell, row by row
};

}  // namespace planar_vslam
