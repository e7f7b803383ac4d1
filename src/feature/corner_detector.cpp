#include "corner_detector.h"

#include <algorithm>
#include <opencv2/features2d.hpp>

namespace planar_vslam {
namespace {

// cv::FAST leaves 3 px at the border of its image untested, and suppression looks one pixel further.
constexpr int kFastReach = 4;  // px

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

void CornerDetector::DetectInside(const cv::Mat& level, const cv::Rect& area, int threshold,
                                  std::vector<Corner>* corners) {
  // Padded so that corners at the rim of `area` compete with their neighbours outside, as in a search of the whole
  // level; the neighbours are then dropped.
  const cv::Rect padded(area.x - kFastReach, area.y - kFastReach, area.width + 2 * kFastReach,
                        area.height + 2 * kFastReach);
  cv::FAST(level(padded), found_, threshold, true);
  for (const cv::KeyPoint& keypoint : found_) {
    const cv::Point pixel(cvRound(keypoint.pt.x) + padded.x, cvRound(keypoint.pt.y) + padded.y);
    if (area.contains(pixel)) corners->push_back({pixel.x, pixel.y, keypoint.response});
  }
}

void CornerDetector::Detect(const cv::Mat& level, const cv::Rect& inner, const CornerThresholds& thresholds,
                            std::vector<Corner>* corners) {
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
