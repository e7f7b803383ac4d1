#pragma once
// Strong, ordered, never reused ids, and a map keyed by them that iterates in id order.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <utility>
#include <vector>

#include "planar_vslam/geometry/check.h"
#include "planar_vslam/map/shared_value.h"

namespace planar_vslam {

template <class Tag>
struct Id {
  static constexpr std::uint32_t kInvalid = 0xFFFFFFFFU;
  std::uint32_t value = kInvalid;

  bool valid() const { return value != kInvalid; }
  friend bool operator==(Id a, Id b) { return a.value == b.value; }
  friend bool operator!=(Id a, Id b) { return a.value != b.value; }
  friend bool operator<(Id a, Id b) { return a.value < b.value; }
  friend bool operator>(Id a, Id b) { return a.value > b.value; }
};

using KeyframeId = Id<struct KeyframeTag>;
using LandmarkId = Id<struct LandmarkTag>;

// Values in the order of their ids. Copies share what none of them has changed since: values hang in leaves, leaves in
// nodes, by the digits of their id, and a value that is written to is copied with its leaf and node first. Copying is
// O(ids given out / 2048), Find O(1). Ids that are given out in order and erased for good cost nothing but that.
// Reading never copies: a value is written to through Edit() and its kin only. References to values stay good until
// the value is erased or another copy of the map writes to it.
template <class IdType, class Value>
class IdMap {
 public:
  using Entry = std::pair<const IdType, Value>;
  class Iterator;

  bool empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }
  Iterator begin() const { return Iterator(this, FirstFrom(0)); }
  Iterator end() const { return Iterator(this, nullptr); }
  // The first entry that is not below `id`.
  Iterator From(IdType id) const { return Iterator(this, FirstFrom(id.value)); }

  const Value* Find(IdType id) const {
    const Entry* entry = FindEntry(id.value);
    return entry != nullptr ? &entry->second : nullptr;
  }
  bool Contains(IdType id) const { return FindEntry(id.value) != nullptr; }

  // The value of an id that is known to exist.
  const Value& At(IdType id) const {
    const Value* value = Find(id);
    PV_CHECK(value != nullptr, "id=" << id.value);
    return *value;
  }

  // The value of an id that is known to exist, to be written to.
  Value& Edit(IdType id) {
    PV_CHECK(Contains(id), "id=" << id.value);
    return LeafToEdit(id.value).entries[SlotOf(id.value)].Own().second;
  }
  Value* FindToEdit(IdType id) { return Contains(id) ? &Edit(id) : nullptr; }
  std::vector<IdType> Ids() const {
    std::vector<IdType> ids;
    ids.reserve(size_);
    for (const Entry& entry : *this) ids.push_back(entry.first);
    return ids;
  }

  // Position of an id in the order of ids; size() where it is not there.
  std::size_t IndexOf(IdType id) const {
    if (!Contains(id)) return size_;
    std::size_t index = 0;
    for (std::size_t n = 0; n < NodeOf(id.value); ++n) index += nodes_[n] ? nodes_[n]->size : 0;
    const Node& node = *nodes_[NodeOf(id.value)];
    for (std::size_t l = 0; l < LeafOf(id.value); ++l) index += node.leaves[l] ? node.leaves[l]->size : 0;
    const Leaf& leaf = *node.leaves[LeafOf(id.value)];
    for (std::size_t slot = 0; slot < SlotOf(id.value); ++slot) index += leaf.entries[slot] ? 1 : 0;
    return index;
  }
  // The entry at a position below size().
  const Entry& EntryAt(std::size_t index) const {
    PV_CHECK(index < size_, "index=" << index << " of " << size_);
    std::size_t n = 0, l = 0;
    for (; !nodes_[n] || index >= nodes_[n]->size; ++n) index -= nodes_[n] ? nodes_[n]->size : 0;
    const auto& leaves = nodes_[n]->leaves;
    for (; !leaves[l] || index >= leaves[l]->size; ++l) index -= leaves[l] ? leaves[l]->size : 0;
    const auto& entries = leaves[l]->entries;
    std::size_t slot = 0;
    for (; !entries[slot] || index > 0; ++slot) index -= entries[slot] ? 1 : 0;
    return *entries[slot];
  }
  // The entry with the next smaller id, or none. `id` itself need not be there.
  const Entry* Before(IdType id) const { return LastBelow(id.value); }
  // The entry with the next larger id than that of one that is there, or none.
  const Entry* After(IdType id) const {
    PV_CHECK(Contains(id), "id=" << id.value);
    const std::size_t next = IndexOf(id) + 1;
    return next < size_ ? &EntryAt(next) : nullptr;
  }

  // `id` must be new. The value to write to.
  Value& Insert(IdType id, Value value) {
    PV_CHECK(id.valid() && !Contains(id), "id=" << id.value << " inserted twice");
    if (NodeOf(id.value) >= nodes_.size()) nodes_.resize(NodeOf(id.value) + 1);
    SharedValue<Node>& node = nodes_[NodeOf(id.value)];
    if (!node) node = SharedValue<Node>::Make();
    SharedValue<Leaf>& leaf = node.Own().leaves[LeafOf(id.value)];
    if (!leaf) leaf = SharedValue<Leaf>::Make();
    SharedValue<Entry>& entry = leaf.Own().entries[SlotOf(id.value)];
    entry = SharedValue<Entry>::Make(id, std::move(value));
    ++size_;
    ++node.Own().size;
    ++leaf.Own().size;
    return entry.Own().second;
  }

  // Ids that are not present are passed over.
  void Erase(const std::vector<IdType>& ids) {
    for (const IdType id : ids) {
      if (!Contains(id)) continue;
      Leaf& leaf = LeafToEdit(id.value);
      leaf.entries[SlotOf(id.value)] = {};
      --size_;
      Node& node = nodes_[NodeOf(id.value)].Own();
      if (--leaf.size == 0) node.leaves[LeafOf(id.value)] = {};
      if (--node.size == 0) nodes_[NodeOf(id.value)] = {};
    }
    while (!nodes_.empty() && !nodes_.back()) nodes_.pop_back();
  }

  // Calls `visit(id, const Value* before, const Value* now)` for the ids, ascending, whose value this map and `before`
  // do not share; null where it is not there. The values may still be equal. O(ids given out / 2048 + differences).
  template <class Visit>
  void VisitChanges(const IdMap& before, const Visit& visit) const {
    for (std::size_t n = 0; n < std::max(nodes_.size(), before.nodes_.size()); ++n) {
      const Node* now = n < nodes_.size() ? nodes_[n].get() : nullptr;
      const Node* old = n < before.nodes_.size() ? before.nodes_[n].get() : nullptr;
      if (now == old) continue;
      for (std::size_t l = 0; l < kLeaves; ++l) {
        const Leaf* leaf = now != nullptr ? now->leaves[l].get() : nullptr;
        const Leaf* old_leaf = old != nullptr ? old->leaves[l].get() : nullptr;
        if (leaf == old_leaf) continue;
        for (std::size_t slot = 0; slot < kSlots; ++slot) {
          const Entry* entry = leaf != nullptr ? leaf->entries[slot].get() : nullptr;
          const Entry* old_entry = old_leaf != nullptr ? old_leaf->entries[slot].get() : nullptr;
          if (entry == old_entry) continue;
          visit((entry != nullptr ? entry : old_entry)->first, old_entry != nullptr ? &old_entry->second : nullptr,
                entry != nullptr ? &entry->second : nullptr);
        }
      }
    }
  }

 private:
  static constexpr std::size_t kSlots = 32, kLeaves = 64;
  struct Leaf {
    std::array<SharedValue<Entry>, kSlots> entries;
    std::size_t size = 0;
  };
  struct Node {
    std::array<SharedValue<Leaf>, kLeaves> leaves;
    std::size_t size = 0;
  };
  static std::size_t SlotOf(std::uint32_t id) { return id % kSlots; }
  static std::size_t LeafOf(std::uint32_t id) { return id / kSlots % kLeaves; }
  static std::size_t NodeOf(std::uint32_t id) { return id / (kSlots * kLeaves); }

  const Leaf* FindLeaf(std::uint32_t id) const {
    const std::size_t n = NodeOf(id);
    return n < nodes_.size() && nodes_[n] ? nodes_[n]->leaves[LeafOf(id)].get() : nullptr;
  }
  const Entry* FindEntry(std::uint32_t id) const {
    const Leaf* leaf = FindLeaf(id);
    return leaf != nullptr ? leaf->entries[SlotOf(id)].get() : nullptr;
  }
  Leaf& LeafToEdit(std::uint32_t id) { return nodes_[NodeOf(id)].Own().leaves[LeafOf(id)].Own(); }

  // The entry with the least id that is not below `id`, or none.
  const Entry* FirstFrom(std::uint32_t id) const {
    std::size_t l = LeafOf(id), slot = SlotOf(id);
    for (std::size_t n = NodeOf(id); n < nodes_.size(); ++n, l = 0, slot = 0) {
      if (!nodes_[n]) continue;
      for (; l < kLeaves; ++l, slot = 0) {
        const Leaf* leaf = nodes_[n]->leaves[l].get();
        if (leaf == nullptr) continue;
        for (; slot < kSlots; ++slot) {
          if (leaf->entries[slot]) return leaf->entries[slot].get();
        }
      }
    }
    return nullptr;
  }
  // The entry with the greatest id below `id`, or none.
  const Entry* LastBelow(std::uint32_t id) const {
    std::size_t n = NodeOf(id), l = LeafOf(id), slot = SlotOf(id);
    if (n >= nodes_.size()) {
      n = nodes_.size();
      l = slot = 0;
    }
    for (;; l = kLeaves, slot = 0) {
      if (n < nodes_.size() && nodes_[n]) {
        for (;; slot = kSlots) {
          const Leaf* leaf = l < kLeaves ? nodes_[n]->leaves[l].get() : nullptr;
          for (; leaf != nullptr && slot > 0; --slot) {
            if (leaf->entries[slot - 1]) return leaf->entries[slot - 1].get();
          }
          if (l-- == 0) break;
        }
      }
      if (n-- == 0) return nullptr;
    }
  }

  std::vector<SharedValue<Node>> nodes_;  // by id; the last one holds something
  std::size_t size_ = 0;
};

// Goes through the entries as they were when it was made, as long as none is inserted, erased or written to.
template <class IdType, class Value>
class IdMap<IdType, Value>::Iterator {
 public:
  using iterator_category = std::bidirectional_iterator_tag;  // NOLINT(readability-identifier-naming): the standard's
  using value_type = Entry;                                   // NOLINT(readability-identifier-naming): the standard's
  using difference_type = std::ptrdiff_t;                     // NOLINT(readability-identifier-naming): the standard's
  using pointer = const Entry*;                               // NOLINT(readability-identifier-naming): the standard's
  using reference = const Entry&;                             // NOLINT(readability-identifier-naming): the standard's

  Iterator() = default;
  Iterator(const IdMap* map, const Entry* entry) : map_(map), entry_(entry) {}

  reference operator*() const { return *entry_; }
  pointer operator->() const { return entry_; }
  Iterator& operator++() {
    entry_ = map_->FirstFrom(entry_->first.value + 1);
    return *this;
  }
  Iterator& operator--() {
    entry_ = map_->LastBelow(entry_ != nullptr ? entry_->first.value : IdType::kInvalid);
    return *this;
  }
  Iterator operator++(int) { return std::exchange(*this, std::next(*this)); }
  Iterator operator--(int) { return std::exchange(*this, std::prev(*this)); }
  friend bool operator==(const Iterator& a, const Iterator& b) { return a.entry_ == b.entry_; }
  friend bool operator!=(const Iterator& a, const Iterator& b) { return a.entry_ != b.entry_; }

 private:
  const IdMap* map_ = nullptr;
  const Entry* entry_ = nullptr;  // none: the end
};

}  // namespace planar_vslam
