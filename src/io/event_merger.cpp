#include "event_merger.h"

#include <algorithm>

#include "planar_vslam/geometry/check.h"

namespace planar_vslam::io {

bool EventMerger::Push(Stream stream, Timestamp stamp, RecordedEvent event) {
  if (last_popped_.has_value() && stamp < *last_popped_) return false;
  std::deque<Entry>& queue = queues_[static_cast<std::size_t>(stream)];
  PV_CHECK(queue.empty() || queue.back().stamp < stamp, "stream " << static_cast<int>(stream));
  queue.push_back({stamp, std::move(event)});
  newest_ = newest_.has_value() ? std::max(*newest_, stamp) : stamp;
  return true;
}

bool EventMerger::AllActiveStreamsWait() const {
  for (std::size_t i = 0; i < kStreamCount; ++i) {
    if (active_[i] && queues_[i].empty()) return false;
  }
  return true;
}

std::optional<RecordedEvent> EventMerger::Pop() {
  std::deque<Entry>* earliest = nullptr;
  for (std::deque<Entry>& queue : queues_) {
    if (queue.empty()) continue;
    if (earliest == nullptr || queue.front().stamp < earliest->front().stamp) earliest = &queue;
  }
  if (earliest == nullptr) return std::nullopt;
  const Timestamp stamp = earliest->front().stamp;
  const bool settled = finished_ || AllActiveStreamsWait() || SecondsBetween(stamp, *newest_) > kPatienceSeconds;
  if (!settled) return std::nullopt;
  last_popped_ = stamp;
  RecordedEvent event = std::move(earliest->front().event);
  earliest->pop_front();
  return event;
}

}  // namespace planar_vslam::io
