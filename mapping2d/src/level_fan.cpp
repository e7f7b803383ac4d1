#include "level_fan.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace planar_vslam {

bool LevelFan::Start(const Eigen::Vector3d& origin, double reach) {
  const Eigen::Vector3d center = origin * voxels_per_meter_;
  const std::optional<VoxelIndex> at = VoxelOf(center);
  const double half = std::ceil(reach * voxels_per_meter_) + 1.0;
  if (!at.has_value() || half > kLatticeReach) return false;
  const auto reach_cells = static_cast<std::int32_t>(half);
  const auto block_floor = [](std::int32_t cell) { return cell & ~(kBlockSide - 1); };
  corner_ = {block_floor(at->x - reach_cells), block_floor(at->y - reach_cells), at->z};
  side_ = block_floor(2 * reach_cells + 2 * kBlockSide);
  if (std::min(corner_.x, corner_.y) < 0 || std::max(corner_.x, corner_.y) + side_ > 2 * kLatticeReach) return false;
  start_ = center.head<2>() + Eigen::Vector2d(kLatticeReach - corner_.x, kLatticeReach - corner_.y);
  marks_.assign(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_), Sighting::kUnseen);
  return true;
}

// For each row of cells across the longer axis the two that the ray enters and leaves it by.
void LevelFan::AddFreeRay(const Eigen::Vector3d& to) {
  const Eigen::Vector2d end =
      to.head<2>() * voxels_per_meter_ + Eigen::Vector2d(kLatticeReach - corner_.x, kLatticeReach - corner_.y);
  const Eigen::Vector2i first = start_.cast<int>(), last = end.cast<int>();
  const int major = std::abs(last.x() - first.x()) >= std::abs(last.y() - first.y()) ? 0 : 1, minor = 1 - major;
  const std::int32_t step = last[major] > first[major] ? 1 : -1, rows = std::abs(last[major] - first[major]);
  const std::int32_t major_stride = major == 0 ? 1 : side_, minor_stride = major == 0 ? side_ : 1;
  // Where the ray leaves the first row, and how much farther the next ones, in 2^-32 cells.
  constexpr double kOne = 4294967296.0;
  const double slope = rows > 0 ? (end[minor] - start_[minor]) / (end[major] - start_[major]) : 0.0;
  const double leaves = first[major] + (step > 0 ? 1 : 0) - start_[major];
  auto position = static_cast<std::int64_t>((start_[minor] + slope * leaves) * kOne);
  const auto per_row = static_cast<std::int64_t>(slope * step * kOne);
  const auto [low, high] = std::minmax(first[minor], last[minor]);
  std::uint8_t* row = marks_.data() + first[major] * major_stride;
  std::int32_t enters = first[minor];
  for (std::int32_t i = 0; i < rows; ++i) {
    const std::int32_t exits = std::clamp(static_cast<std::int32_t>(position >> 32U), low, high);
    row[enters * minor_stride] = Sighting::kFree;
    row[exits * minor_stride] = Sighting::kFree;
    enters = exits;
    position += per_row;
    row += step * major_stride;
  }
  if (enters != last[minor]) row[enters * minor_stride] = Sighting::kFree;
}

void LevelFan::AddTo(Sighting* sighting) const {
  for (std::int32_t y = 0; y < side_; y += kBlockSide) {
    for (std::int32_t x = 0; x < side_; x += kBlockSide) {
      const std::uint8_t* first = marks_.data() + y * side_ + x;
      sighting->AddFreeBlock({corner_.x + x, corner_.y + y, corner_.z}, first, side_);
    }
  }
}

}  // namespace planar_vslam
