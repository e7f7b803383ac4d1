#pragma once
// The smoothing cv::ORB applies to a level before it describes it, bit for bit, where descriptors look.
#include <array>
#include <opencv2/core.hpp>
#include <vector>

#include "corner_detector.h"
#include "planar_vslam/feature/instruction_set.h"

namespace planar_vslam {

// Gaussian of 7x7 px and sigma 2, in single precision with fused multiply-add: along rows from left to right, then
// along columns from the centre outwards, then to the nearest integer, ties to even. So does OpenCV's separable filter,
// which cv::ORB uses, on processors that have that instruction; the others get the same bits here.
class BriefBlur {
 public:
  static constexpr int kRadius = 3;                // px
  static constexpr int kBlock = 16;                // px worked on at a time
  static constexpr int kMinSide = 4;               // px; below, the image reflected at its border would not suffice
  using Weights = std::array<float, kRadius + 1>;  // of the centre and of the pixels beside it, nearest first
  using SumRows = std::array<const float*, 2 * kRadius + 1>;

  explicit BriefBlur(InstructionSet set);
  // Makes *blurred the size of `level`, of kMinSide or more. Only pixels at most `reach` px, in x and y, from a corner
  // have values; the others are arbitrary. `corners` are in reading order. *blurred is good until the next call.
  void Apply(const cv::Mat& level, const std::vector<Corner>& corners, int reach, cv::Mat* blurred);

 private:
  struct Kernel {
    void (*widen)(const std::uint8_t* pixels, int count, float* wide);
    // `wide` begins kRadius px left of the `count` px, whole blocks, that are asked for.
    void (*along_row)(const float* wide, int count, const Weights& weights, float* sums);
    // `rows` are sums from kRadius px above to as much below. Writes the indices of pixels that rounding errors may
    // have changed to `doubtful`, and returns how many.
    int (*along_column)(const SumRows& rows, int count, const Weights& weights, std::uint8_t* blurred, int* doubtful);
  };
  static Kernel KernelOf(InstructionSet set);

  // Which pixels of a row are near a corner, in whole blocks and for a few rows together. Rows are asked for in
  // ascending order.
  class Coverage {
   public:
    struct Run {
      int begin = 0, end = 0;
    };
    void Reset(int reach_x, int reach_y, std::size_t block_count);
    const std::vector<Run>& RunsOf(int row, const std::vector<Corner>& corners);

   private:
    static constexpr int kRows = 4;  // taken together
    int reach_x_ = 0, reach_y_ = 0;  // px
    std::size_t next_ = 0;           // the first corner further down
    int band_ = -1;                  // row / kRows of runs_
    std::vector<int> last_row_;      // of each block: the last row near a corner, as far as known
    std::vector<Run> runs_;
  };
  void FilterRow(const cv::Mat& level, int y, const std::vector<Coverage::Run>& runs);
  void FilterColumns(const cv::Mat& level, int y, const std::vector<Coverage::Run>& runs);
  float* SumsOf(int y) { return &sums_[static_cast<std::size_t>(y % (2 * kRadius + 1)) * stride_]; }

  Kernel kernel_;
  Weights weights_{};
  std::size_t stride_ = 0;     // px; whole blocks
  std::vector<float> wide_;    // one row with its border
  std::vector<float> sums_;    // along the last rows, one for each weight of a column
  std::vector<int> doubtful_;  // of one run
  cv::Mat buffer_;             // stride_ wide
  Coverage rows_, columns_;
};

}  // namespace planar_vslam
