#include "sighting.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace planar_vslam {

// Steps along one axis of the lattice, and where on the ray (0 at its start, 1 at its end) the next one is due.
struct Sighting::Axis {
  std::int32_t step;
  std::int32_t left;
  double next;
  double interval;

  Axis(double from, double to, std::int32_t first, std::int32_t last)
      : step(last > first ? 1 : -1), left(std::abs(last - first)) {
    const double lower = std::floor(from), boundary = step > 0 ? lower + 1.0 : lower;
    interval = 1.0 / std::abs(to - from);
    next = left > 0 ? std::abs(boundary - from) * interval : std::numeric_limits<double>::infinity();
  }

  // An axis takes as many steps as lie between the end voxels, so that rounding cannot lead past the end.
  void Advance(std::int32_t* coordinate) {
    *coordinate += step;
    next = --left > 0 ? next + interval : std::numeric_limits<double>::infinity();
  }
};

Sighting::Marks& Sighting::Block(const VoxelIndex& voxel) {
  const std::uint32_t number = index_.FindOrInsert(BlockOf(voxel));
  if (number == marks_.size()) marks_.emplace_back().fill(kUnseen);
  return marks_[number];
}

void Sighting::Trace(VoxelIndex at, Axis x, Axis y, Axis z) {
  const std::int32_t steps = x.left + y.left + z.left;
  BlockKey block = 0;
  Marks* marks = nullptr;
  for (std::int32_t i = 0; i < steps; ++i) {
    if (const BlockKey here = BlockOf(at); marks == nullptr || here != block) {
      block = here;
      marks = &Block(at);
    }
    std::uint8_t& mark = (*marks)[static_cast<std::size_t>(CellOf(at))];
    mark = std::max(mark, kFree);
    if (x.next < y.next) {
      x.next < z.next ? x.Advance(&at.x) : z.Advance(&at.z);
    } else {
      y.next < z.next ? y.Advance(&at.y) : z.Advance(&at.z);
    }
  }
}

void Sighting::AddFreeRay(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d start = from * voxels_per_meter_, end = to * voxels_per_meter_;
  const std::optional<VoxelIndex> first = VoxelOf(start), last = VoxelOf(end);
  if (!first.has_value() || !last.has_value()) return;
  Trace(*first, Axis(start.x(), end.x(), first->x, last->x), Axis(start.y(), end.y(), first->y, last->y),
        Axis(start.z(), end.z(), first->z, last->z));
}

void Sighting::AddFreeBlock(const VoxelIndex& corner, const std::uint8_t* marks, std::int32_t stride) {
  unsigned any = 0;
  for (std::int32_t row = 0; row < kBlockSide; ++row) {
    for (std::int32_t i = 0; i < kBlockSide; ++i) any |= marks[row * stride + i];
  }
  if (any == 0) return;
  std::uint8_t* block = Block(corner).data();
  for (std::int32_t row = 0; row < kBlockSide; ++row) {
    for (std::int32_t i = 0; i < kBlockSide; ++i, ++block) *block = std::max(*block, marks[row * stride + i]);
  }
}

void Sighting::AddHit(const Eigen::Vector3d& point, double weight) {
  const std::optional<VoxelIndex> voxel = VoxelOf(point * voxels_per_meter_);
  if (!voxel.has_value()) return;
  Raise(*voxel, static_cast<std::uint8_t>(kLightestHit + std::lround(weight * (kFullHit - kLightestHit))));
}

void Sighting::SpareAround(const Eigen::Vector3d& point) {
  const std::optional<VoxelIndex> voxel = VoxelOf(point * voxels_per_meter_);
  if (!voxel.has_value()) return;
  for (int y = std::max(voxel->y - 1, 0); y <= std::min(voxel->y + 1, 2 * kLatticeReach - 1); ++y) {
    for (int x = std::max(voxel->x - 1, 0); x <= std::min(voxel->x + 1, 2 * kLatticeReach - 1); ++x) {
      Raise({x, y, voxel->z}, kSpared);
    }
  }
}

void Sighting::Raise(const VoxelIndex& voxel, std::uint8_t mark) {
  std::uint8_t& before = Block(voxel)[static_cast<std::size_t>(CellOf(voxel))];
  before = std::max(before, mark);
}

void Sighting::Clear() {
  for (std::size_t i = 0; i < index_.keys().size(); ++i) marks_[i].fill(kUnseen);
  index_.Clear();
}

}  // namespace planar_vslam
