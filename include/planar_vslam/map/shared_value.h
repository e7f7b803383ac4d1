#pragma once
// A value that copies share until one of them writes to it.
#include <atomic>
#include <cstdint>
#include <utility>

namespace planar_vslam {

// Copies may live on different threads; one copy belongs to one thread at a time. May hold nothing.
template <class Value>
class SharedValue {
 public:
  SharedValue() = default;
  template <class... Parts>
  static SharedValue Make(Parts&&... parts) {
    SharedValue made;
    made.box_ = new Box(std::forward<Parts>(parts)...);
    return made;
  }
  SharedValue(const SharedValue& other) : box_(other.box_) {
    if (box_ != nullptr) box_->holders.fetch_add(1, std::memory_order_relaxed);
  }
  SharedValue(SharedValue&& other) noexcept : box_(std::exchange(other.box_, nullptr)) {}
  SharedValue& operator=(SharedValue other) noexcept {
    std::swap(box_, other.box_);
    return *this;
  }
  ~SharedValue() {
    if (box_ != nullptr && box_->holders.fetch_sub(1, std::memory_order_acq_rel) == 1) delete box_;
  }

  const Value* get() const { return box_ != nullptr ? &box_->value : nullptr; }
  const Value& operator*() const { return box_->value; }
  const Value* operator->() const { return &box_->value; }
  explicit operator bool() const { return box_ != nullptr; }

  // The value to write to, copied first where others share it. Holds one.
  Value& Own() {
    // Nobody else can come to share it meanwhile: there is no other holder to copy from.
    if (box_->holders.load(std::memory_order_acquire) != 1) *this = Make(std::as_const(box_->value));
    return box_->value;
  }

 private:
  struct Box {
    template <class... Parts>
    explicit Box(Parts&&... parts) : value(std::forward<Parts>(parts)...) {}
    std::atomic<std::uint32_t> holders{1};
    Value value;
  };
  Box* box_ = nullptr;
};

}  // namespace planar_vslam
