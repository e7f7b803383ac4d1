#pragma once
// Strong, ordered, never reused ids, and a map keyed by them that iterates in id order.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <utility>
#include <vector>

#include "planar_vslam/geometry/check.h"

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

// Values sorted by id in one vector. Find is O(log n), appending a larger id O(1), erasing a batch O(n).
template <class IdType, class Value>
class IdMap {
 public:
  using Entry = std::pair<IdType, Value>;

  bool empty() const { return entries_.empty(); }
  std::size_t size() const { return entries_.size(); }
  auto begin() const { return entries_.begin(); }
  auto end() const { return entries_.end(); }
  auto begin() { return entries_.begin(); }
  auto end() { return entries_.end(); }

  const Value* Find(IdType id) const {
    const auto it = LowerBound(id);
    return it != entries_.end() && it->first == id ? &it->second : nullptr;
  }
  Value* Find(IdType id) { return const_cast<Value*>(std::as_const(*this).Find(id)); }
  bool Contains(IdType id) const { return Find(id) != nullptr; }

  // The value of an id that is known to exist.
  const Value& At(IdType id) const {
    const Value* value = Find(id);
    PV_CHECK(value != nullptr, "id=" << id.value);
    return *value;
  }
  Value& At(IdType id) { return const_cast<Value&>(std::as_const(*this).At(id)); }

  // Position of an id in the order of ids; size() where it is not there.
  std::size_t IndexOf(IdType id) const {
    const auto it = LowerBound(id);
    return it != entries_.end() && it->first == id ? static_cast<std::size_t>(it - entries_.begin()) : entries_.size();
  }
  // The entry at a position below size().
  const Entry& EntryAt(std::size_t index) const {
    PV_CHECK(index < entries_.size(), "index=" << index << " of " << entries_.size());
    return entries_[index];
  }
  // The entry with the next smaller id, or none. `id` itself need not be there.
  const Entry* Before(IdType id) const {
    const auto it = LowerBound(id);
    return it != entries_.begin() ? &*std::prev(it) : nullptr;
  }

  // `id` must be new.
  Value& Insert(IdType id, Value value) {
    auto it = entries_.end();
    if (!entries_.empty() && !(entries_.back().first < id)) {
      it = entries_.begin() + (LowerBound(id) - entries_.begin());
      PV_CHECK(it == entries_.end() || it->first != id, "id=" << id.value << " inserted twice");
    }
    return entries_.insert(it, Entry(id, std::move(value)))->second;
  }

  // `ids` sorted ascending; ids that are not present are passed over.
  void Erase(const std::vector<IdType>& ids) {
    const auto gone = [&ids](const Entry& e) { return std::binary_search(ids.begin(), ids.end(), e.first); };
    entries_.erase(std::remove_if(entries_.begin(), entries_.end(), gone), entries_.end());
  }

 private:
  auto LowerBound(IdType id) const {
    return std::lower_bound(entries_.begin(), entries_.end(), id, [](const Entry& e, IdType i) { return e.first < i; });
  }
  std::vector<Entry> entries_;
};

}  // namespace planar_vslam
