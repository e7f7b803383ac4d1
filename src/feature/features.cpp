#include "planar_vslam/feature/features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>

namespace planar_vslam {
namespace {

// Bounds the memory of a grid over keypoints that a wild distortion threw far away; the outermost cells then hold
// all that lies beyond, which a search still finds.
constexpr int kMaxCellsPerAxis = 512;

// Cell of a coordinate along one axis; never decreases as the coordinate grows.
int CellOf(float coordinate, float origin, float cell_pixels, int cell_count) {
  const float cell = (coordinate - origin) / cell_pixels;
  if (!(cell > 0.0F)) return 0;
  return cell < static_cast<float>(cell_count) ? static_cast<int>(cell) : cell_count - 1;
}

// Sorts different numbers. Up to kMostRanked of them each go where as many are smaller: more comparisons than needed,
// but several at a time and no branch to predict, unlike those of std::sort.
void SortDistinct(int* begin, int* end) {
  using Four [[gnu::vector_size(16)]] = int;
  constexpr std::size_t kMostRanked = 64;
  const std::size_t count = static_cast<std::size_t>(end - begin);
  if (count < 2) return;
  if (count > kMostRanked) return std::sort(begin, end);
  const std::size_t four_count = (count + 3) / 4;
  std::array<Four, kMostRanked / 4> numbers, ranks;
  numbers[four_count - 1] = Four{};
  std::memcpy(numbers.data(), begin, count * sizeof(int));
  std::fill(ranks.data(), ranks.data() + four_count, Four{});
  for (const int* number = begin; number != end; ++number) {
    const Four same = Four{} + *number;
    for (std::size_t k = 0; k < four_count; ++k) ranks[k] -= same < numbers[k];  // a true comparison is -1
  }
  std::array<int, kMostRanked> sorted;
  for (std::size_t k = 0; k < count; ++k) sorted[static_cast<std::size_t>(ranks[k / 4][k % 4])] = begin[k];
  std::memcpy(begin, sorted.data(), count * sizeof(int));
}

int CellCount(float extent, float cell_pixels) { return 1 + CellOf(extent, 0.0F, cell_pixels, kMaxCellsPerAxis); }

}  // namespace

ImageGrid::ImageGrid(const std::vector<Keypoint>& keypoints) {
  if (keypoints.empty()) return;
  Eigen::Vector2f upper = keypoints.front().pixel;
  origin_ = upper;
  for (const Keypoint& keypoint : keypoints) {
    origin_ = origin_.cwiseMin(keypoint.pixel);
    upper = upper.cwiseMax(keypoint.pixel);
  }
  columns_ = CellCount(upper.x() - origin_.x(), kCellPixels);
  rows_ = CellCount(upper.y() - origin_.y(), kCellPixels);

  std::vector<int> cell_of(keypoints.size());
  cell_begin_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_) + 1, 0);
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    const Eigen::Vector2f& pixel = keypoints[i].pixel;
    cell_of[i] = CellOf(pixel.y(), origin_.y(), kCellPixels, rows_) * columns_ +
                 CellOf(pixel.x(), origin_.x(), kCellPixels, columns_);
    ++cell_begin_[static_cast<std::size_t>(cell_of[i]) + 1];
  }
  std::partial_sum(cell_begin_.begin(), cell_begin_.end(), cell_begin_.begin());

  members_.resize(keypoints.size());
  std::vector<std::int32_t> next(cell_begin_.begin(), cell_begin_.end() - 1);
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    std::int32_t& slot = next[static_cast<std::size_t>(cell_of[i])];
    members_[static_cast<std::size_t>(slot++)] = static_cast<std::int32_t>(i);
  }
}

void ImageGrid::Search(const std::vector<Keypoint>& keypoints, const Eigen::Vector2f& center, float radius,
                       int min_octave, int max_octave, std::vector<int>* indices) const {
  if (members_.empty() || !(radius >= 0.0F) || !center.allFinite()) return;
  // One pixel wider than asked, so that rounding of the bounds cannot lose a keypoint that lies on the boundary.
  const float reach = radius + 1.0F;
  const int first_column = CellOf(center.x() - reach, origin_.x(), kCellPixels, columns_);
  const int last_column = CellOf(center.x() + reach, origin_.x(), kCellPixels, columns_);
  const int first_row = CellOf(center.y() - reach, origin_.y(), kCellPixels, rows_);
  const int last_row = CellOf(center.y() + reach, origin_.y(), kCellPixels, rows_);
  const std::size_t old_size = indices->size();
  std::size_t size = old_size;
  for (int row = first_row; row <= last_row; ++row) {
    // The cells of a row are neighbours in members_.
    const std::size_t row_begin = static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_);
    const std::int32_t begin = cell_begin_[row_begin + static_cast<std::size_t>(first_column)];
    const std::int32_t end = cell_begin_[row_begin + static_cast<std::size_t>(last_column) + 1];
    indices->resize(size + static_cast<std::size_t>(end - begin));
    for (std::int32_t m = begin; m < end; ++m) {
      const std::int32_t index = members_[static_cast<std::size_t>(m)];
      const Keypoint& keypoint = keypoints[static_cast<std::size_t>(index)];
      // Without branches: whether a keypoint is near enough is as good as random.
      const int failures = (keypoint.octave < min_octave ? 1 : 0) + (keypoint.octave > max_octave ? 1 : 0) +
                           (std::abs(keypoint.pixel.x() - center.x()) <= radius ? 0 : 1) +
                           (std::abs(keypoint.pixel.y() - center.y()) <= radius ? 0 : 1);
      (*indices)[size] = index;
      size += failures == 0 ? 1 : 0;
    }
  }
  indices->resize(size);
  SortDistinct(indices->data() + old_size, indices->data() + size);
}

}  // namespace planar_vslam
