#pragma once
// Shrinks one pyramid level to the next, bit for bit as cv::resize does with INTER_LINEAR.
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "planar_vslam/feature/instruction_set.h"

namespace planar_vslam {

// Bilinear interpolation in fixed point: along rows with weights of 11 bits, less 4 bits, then along columns. Keeps its
// tables while the sizes stay the same.
class LevelResizer {
 public:
  explicit LevelResizer(InstructionSet set) : set_(set) {}
  // `size` is no larger than `source`, which has 2 columns or more. *resized is good until the next call.
  void Resize(const cv::Mat& source, const cv::Size& size, cv::Mat* resized);

  // Where the pixels along a row come from. Columns are padded to a multiple of kGroup * 2.
  struct RowTable {
    static constexpr std::size_t kGroup = 8;  // columns worked out together
    std::vector<std::int32_t> left;           // of each column: the first of the two source pixels; the other is next
    std::vector<std::int16_t> weights;        // two for each column
    std::vector<std::int32_t> begin;          // of each group: its columns come from the 16 source pixels from here on
    std::vector<std::uint8_t> shuffle;        // two for each column: source pixels as counted from `begin`
    bool has_groups = false;                  // whether 16 are enough for all groups

    RowTable() = default;
    RowTable(int source_columns, int columns);
    std::size_t columns() const { return left.size(); }  // padded
  };

 private:
  const std::int16_t* SumsOf(const cv::Mat& source, int row);

  InstructionSet set_;
  cv::Size source_size_, size_;
  RowTable table_;
  std::array<std::vector<std::int16_t>, 2> sums_;  // along the last rows, even and odd ones
  std::array<int, 2> sums_row_{-1, -1};
  cv::Mat buffer_;
};

}  // namespace planar_vslam
