#include "corner_detector.h"

#include <algorithm>

#include "planar_vslam/geometry/check.h"

namespace planar_vslam {
namespace {

// One axis of `pixels` px divided into `count` cells of nearly equal size.
struct CellAxis {
  CellAxis(int pixels_in, int cell_pixels)
      : pixels(pixels_in), count(std::max(1, (pixels_in + cell_pixels / 2) / cell_pixels)) {}
  int CellOf(int offset) const { return offset * count / pixels; }
  int Begin(int cell) const { return (cell * pixels + count - 1) / count; }
  int pixels;
  int count;
};

}  // namespace

void CornerDetector::AppendPeaks(const cv::Rect& area, int y, std::vector<Corner>* corners) {
  const Row& row = RowAt(y);
  kernel_.find_peaks(RowAt(y - 1).contrast.data(), row.contrast.data(), RowAt(y + 1).contrast.data(), row.blocks.data(),
                     row.block_count, peaks_.data());
  int begin = area.x;  // where the block before ended
  const int end = area.x + area.width;
  for (std::size_t b = 0; b < static_cast<std::size_t>(row.block_count); ++b) {
    for (std::uint32_t peaks = peaks_[b]; peaks != 0; peaks &= peaks - 1) {
      const int x = row.blocks[b] + __builtin_ctz(peaks);
      if (x < begin || x >= end) continue;
      const int contrast = row.contrast[static_cast<std::size_t>(x)];
      corners->push_back({x, y, static_cast<float>(contrast - 1)});
    }
    begin = std::max(begin, row.blocks[b] + kContrastBlock);
  }
}

// Corners at the rim of `area` compete with their neighbours outside, as in a search of the whole level.
void CornerDetector::DetectInside(const cv::Mat& level, const cv::Rect& area, int threshold,
                                  std::vector<Corner>* corners) {
  ContrastStretch stretch{nullptr, static_cast<std::ptrdiff_t>(level.step[0]), level.cols, area.x - 1,
                          area.x + area.width + 1};
  for (int y = area.y - 1; y <= area.y + area.height; ++y) {
    Row& row = rows_[static_cast<std::size_t>(y) % rows_.size()];
    stretch.row = level.ptr<std::uint8_t>(y);
    row.block_count =
        kernel_.find_contrast(stretch, static_cast<std::uint8_t>(threshold), row.contrast.data(), row.blocks.data());
    if (y > area.y) AppendPeaks(area, y - 1, corners);
  }
}

void CornerDetector::Detect(const cv::Mat& level, const cv::Rect& inner, const CornerThresholds& thresholds,
                            std::vector<Corner>* corners) {
  PV_CHECK(level.cols >= kMinColumns && inner.x >= kMargin && inner.y >= kMargin &&
               inner.x + inner.width <= level.cols - kMargin && inner.y + inner.height <= level.rows - kMargin,
           "inner=" << inner << " level=" << level.size());
  for (Row& row : rows_) {
    row.contrast.resize(static_cast<std::size_t>(level.cols));
    row.blocks.resize(static_cast<std::size_t>(level.cols) / kContrastBlock + 1);
  }
  peaks_.resize(rows_.front().blocks.size());
  corners->clear();
  DetectInside(level, inner, thresholds.high, corners);

  const CellAxis columns(inner.width, thresholds.cell_pixels), rows(inner.height, thresholds.cell_pixels);
  occupied_.assign(static_cast<std::size_t>(columns.count) * static_cast<std::size_t>(rows.count), 0);
  for (const Corner& corner : *corners) {
    const int cell = rows.CellOf(corner.y - inner.y) * columns.count + columns.CellOf(corner.x - inner.x);
    occupied_[static_cast<std::size_t>(cell)] = 1;
  }
  // Empty cells side by side are searched together: fewer, longer calls.
  for (int row = 0; row < rows.count; ++row) {
    const std::uint8_t* occupied = &occupied_[static_cast<std::size_t>(row * columns.count)];
    for (int begin = 0, end = 0; begin < columns.count; begin = end + 1) {
      for (end = begin; end < columns.count && occupied[end] == 0; ++end) {
      }
      if (end == begin) continue;
      const cv::Rect area(inner.x + columns.Begin(begin), inner.y + rows.Begin(row),
                          columns.Begin(end) - columns.Begin(begin), rows.Begin(row + 1) - rows.Begin(row));
      DetectInside(level, area, thresholds.low, corners);
    }
  }
}

}  // namespace planar_vslam
