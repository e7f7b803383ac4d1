#include "input_queue.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace planar_vslam::ros_face {
namespace {

constexpr std::size_t kUnlimited = std::numeric_limits<std::size_t>::max();
// A robot's odometry and joints come at up to 200 Hz: this many cover 10 s of a busy tracking thread.
constexpr std::size_t kReadingCapacity = 2000;

const char* KindName(const Input& input) {
  static constexpr const char* kNames[] = {"images", "images", "camera infos", "odometry", "scans", "tf", "commands"};
  static_assert(std::size(kNames) == std::variant_size_v<Input>);
  return kNames[input.index()];
}

}  // namespace

std::size_t InputQueue::Capacity(const Input& input) const {
  if (lossless_ || std::holds_alternative<Command>(input)) return kUnlimited;
  if (std::holds_alternative<sensor_msgs::ImageConstPtr>(input)) return image_capacity_;
  if (std::holds_alternative<sensor_msgs::CompressedImageConstPtr>(input)) return image_capacity_;
  // Static transforms are sent once: they must not get lost.
  if (const auto* tf = std::get_if<TfInput>(&input); tf != nullptr && tf->is_static) return kUnlimited;
  return kReadingCapacity;
}

void InputQueue::Push(Input input) {
  const std::size_t capacity = Capacity(input);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (closed_) return;
    const auto same_kind = [&](const Input& other) {
      return other.index() == input.index() && Capacity(other) == capacity;
    };
    if (capacity != kUnlimited &&
        static_cast<std::size_t>(std::count_if(inputs_.begin(), inputs_.end(), same_kind)) >= capacity) {
      ++dropped_[KindName(input)];
      inputs_.erase(std::find_if(inputs_.begin(), inputs_.end(), same_kind));
    }
    if (std::holds_alternative<Command>(input)) {
      inputs_.push_front(std::move(input));
    } else {
      inputs_.push_back(std::move(input));
    }
  }
  wake_.notify_one();
}

std::optional<Input> InputQueue::Pop() {
  std::unique_lock<std::mutex> lock(mutex_);
  wake_.wait(lock, [this] { return closed_ || !inputs_.empty(); });
  if (closed_) return std::nullopt;
  Input input = std::move(inputs_.front());
  inputs_.pop_front();
  return input;
}

void InputQueue::Close() {
  std::deque<Input> discarded;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    closed_ = true;
    discarded.swap(inputs_);
  }
  wake_.notify_all();
}

std::map<std::string, long> InputQueue::dropped() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return dropped_;
}

}  // namespace planar_vslam::ros_face
