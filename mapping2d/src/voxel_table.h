#pragma once
// Log-odds by voxel: voxels in a vector in the order they were first seen, found through a table with open addressing.
#include <cstdint>
#include <vector>

namespace planar_vslam {

using VoxelKey = std::uint64_t;  // the three 16-bit indices of an octomap::OcTreeKey, x highest

struct Voxel {
  VoxelKey key = 0;
  float log_odds = 0.0F;
  float hit = 0.0F;               // evidence of the observation in progress
  std::uint32_t observation = 0;  // last one that touched the voxel, from 1
};

class VoxelTable {
 public:
  const std::vector<Voxel>& voxels() const { return voxels_; }
  Voxel& operator[](std::uint32_t index) { return voxels_[index]; }

  const Voxel* Find(VoxelKey key) const {
    if (slots_.empty()) return nullptr;
    const std::uint32_t index = slots_[SlotOf(key)];
    return index == kEmpty ? nullptr : &voxels_[index];
  }

  std::uint32_t FindOrInsert(VoxelKey key) {
    if (2 * (voxels_.size() + 1) > slots_.size()) Grow();
    std::uint32_t& index = slots_[SlotOf(key)];
    if (index == kEmpty) {
      index = static_cast<std::uint32_t>(voxels_.size());
      voxels_.push_back({key});
    }
    return index;
  }

 private:
  static constexpr std::uint32_t kEmpty = 0xFFFFFFFFU;

  // The slot that holds the key, or the empty one where it belongs.
  std::size_t SlotOf(VoxelKey key) const {
    constexpr std::uint64_t kMultiplier = 0x9E3779B97F4A7C15U;  // 2^64 / golden ratio: Fibonacci hashing (Knuth, 6.4)
    const std::size_t mask = slots_.size() - 1;
    std::size_t at = static_cast<std::size_t>((key * kMultiplier) >> 32U) & mask;
    while (slots_[at] != kEmpty && voxels_[slots_[at]].key != key) at = (at + 1) & mask;
    return at;
  }

  void Grow() {
    constexpr std::size_t kFirstSize = std::size_t{1} << 12U;
    slots_.assign(slots_.empty() ? kFirstSize : 2 * slots_.size(), kEmpty);  // a power of two, for the mask
    for (std::size_t i = 0; i < voxels_.size(); ++i) slots_[SlotOf(voxels_[i].key)] = static_cast<std::uint32_t>(i);
  }

  std::vector<Voxel> voxels_;
  std::vector<std::uint32_t> slots_;  // index into voxels_; at most half of them full
};

}  // namespace planar_vslam
