#pragma once
// Where voxels are: three 16-bit indices as in octomap::OcTreeKey, in blocks of 16 x 16 x 1, so that a level scan
// stays in few of them.
#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "block_index.h"

namespace planar_vslam {

constexpr int kBlockBits = 4;
constexpr int kBlockSide = 1 << kBlockBits;
constexpr int kBlockCells = kBlockSide * kBlockSide;
constexpr int kLatticeReach = 32768;  // voxels each way from the origin

struct VoxelIndex {
  std::int32_t x = 0, y = 0, z = 0;  // 0 .. 65535; the origin of `map` is the lower corner of voxel 32768
};

// The voxel of a position given in voxels from the origin; nothing outside the lattice.
inline std::optional<VoxelIndex> VoxelOf(const Eigen::Vector3d& p_voxels) {
  const Eigen::Array3d at = p_voxels.array().floor() + kLatticeReach;
  if (!((at >= 0.0).all() && (at < 2.0 * kLatticeReach).all())) return std::nullopt;
  return VoxelIndex{static_cast<std::int32_t>(at.x()), static_cast<std::int32_t>(at.y()),
                    static_cast<std::int32_t>(at.z())};
}

// 12 bits for x and y of the block, 16 for its layer; blocks sort by column, then by height.
inline BlockKey BlockOf(const VoxelIndex& v) {
  return static_cast<BlockKey>(v.x >> kBlockBits) << 28U | static_cast<BlockKey>(v.y >> kBlockBits) << 16U |
         static_cast<BlockKey>(v.z);
}
inline int CellOf(const VoxelIndex& v) { return (v.y & (kBlockSide - 1)) << kBlockBits | (v.x & (kBlockSide - 1)); }
inline VoxelIndex VoxelAt(BlockKey block, int cell) {
  return {static_cast<std::int32_t>(block >> 28U & 0xFFFU) << kBlockBits | (cell & (kBlockSide - 1)),
          static_cast<std::int32_t>(block >> 16U & 0xFFFU) << kBlockBits | cell >> kBlockBits,
          static_cast<std::int32_t>(block & 0xFFFFU)};
}

}  // namespace planar_vslam
