#pragma once
// Numbers blocks in the order they are first asked for: open addressing over 64-bit keys.
#include <algorithm>
#include <cstdint>
#include <vector>

namespace planar_vslam {

using BlockKey = std::uint64_t;

class BlockIndex {
 public:
  static constexpr std::uint32_t kAbsent = 0xFFFFFFFFU;

  const std::vector<BlockKey>& keys() const { return keys_; }

  std::uint32_t Find(BlockKey key) const { return slots_.empty() ? kAbsent : slots_[SlotOf(key)]; }

  // A key not seen before gets the number keys().size().
  std::uint32_t FindOrInsert(BlockKey key) {
    if (2 * (keys_.size() + 1) > slots_.size()) Grow();
    std::uint32_t& number = slots_[SlotOf(key)];
    if (number == kAbsent) {
      number = static_cast<std::uint32_t>(keys_.size());
      keys_.push_back(key);
    }
    return number;
  }

  void Clear() {
    std::fill(slots_.begin(), slots_.end(), kAbsent);
    keys_.clear();
  }

 private:
  // The slot that holds the key, or the empty one where it belongs.
  std::size_t SlotOf(BlockKey key) const {
    constexpr std::uint64_t kMultiplier = 0x9E3779B97F4A7C15U;  // 2^64 / golden ratio: Fibonacci hashing (Knuth, 6.4)
    const std::size_t mask = slots_.size() - 1;
    std::size_t at = static_cast<std::size_t>((key * kMultiplier) >> 32U) & mask;
    while (slots_[at] != kAbsent && keys_[slots_[at]] != key) at = (at + 1) & mask;
    return at;
  }

  void Grow() {
    constexpr std::size_t kFirstSize = std::size_t{1} << 9U;
    slots_.assign(slots_.empty() ? kFirstSize : 2 * slots_.size(), kAbsent);  // a power of two, for the mask
    for (std::size_t i = 0; i < keys_.size(); ++i) slots_[SlotOf(keys_[i])] = static_cast<std::uint32_t>(i);
  }

  std::vector<BlockKey> keys_;
  std::vector<std::uint32_t> slots_;  // number of a key; at most half of them full
};

}  // namespace planar_vslam
