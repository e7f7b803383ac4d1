#pragma once
// The voxels that one observation (a keyframe's points, a scan) saw through or hit, each once; hit wins over spared,
// spared over free.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "voxels.h"

namespace planar_vslam {

class Sighting {
 public:
  static constexpr std::uint8_t kUnseen = 0, kFree = 1, kSpared = 2, kLightestHit = 3, kFullHit = 255;
  using Marks = std::array<std::uint8_t, kBlockCells>;

  explicit Sighting(double resolution) : voxels_per_meter_(1.0 / resolution) {}

  // Voxels from `from` up to, not including, the one that holds `to` were seen through (Amanatides and Woo, "A Fast
  // Voxel Traversal Algorithm for Ray Tracing", 1987). A ray that leaves the lattice is ignored.
  void AddFreeRay(const Eigen::Vector3d& from, const Eigen::Vector3d& to);
  // The same for the cells of a block, whose first is `corner`: those whose mark, in rows `stride` apart, is kFree.
  void AddFreeBlock(const VoxelIndex& corner, const std::uint8_t* marks, std::int32_t stride);
  // The voxel of `point` was hit, with `weight` in [0, 1]; of several hits on a voxel the heaviest counts.
  void AddHit(const Eigen::Vector3d& point, double weight);

  // The voxel of `point` and its eight neighbours at the same height may be hit, but not seen through.
  void SpareAround(const Eigen::Vector3d& point);

  // Share of a full hit that a mark stands for.
  static double WeightOf(std::uint8_t mark) {
    return static_cast<double>(mark - kLightestHit) / (kFullHit - kLightestHit);
  }

  const std::vector<BlockKey>& blocks() const { return index_.keys(); }
  const Marks& marks(std::size_t block) const { return marks_[block]; }
  void Clear();

 private:
  struct Axis;
  void Trace(VoxelIndex at, Axis x, Axis y, Axis z);
  Marks& Block(const VoxelIndex& voxel);
  void Raise(const VoxelIndex& voxel, std::uint8_t mark);

  double voxels_per_meter_;
  BlockIndex index_;
  std::vector<Marks> marks_;  // by block; those beyond the index are spare and unseen
};

}  // namespace planar_vslam
