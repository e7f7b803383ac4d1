#pragma once
// Puts the events of several streams, read in order of arrival, into the order of their stamps.
#include <array>
#include <deque>
#include <optional>

#include "planar_vslam/io/recording.h"

namespace planar_vslam::io {

// In the order events with equal stamps are handed out: what an image needs comes before it.
enum class Stream { kOdometry = 0, kLaser = 1, kImage = 2 };
constexpr std::size_t kStreamCount = 3;

class EventMerger {
 public:
  // An event is handed out once every active stream shows a later one, or a stream is this far ahead of it.
  // Robots' images arrive up to a few hundred milliseconds after their stamp.
  static constexpr double kPatienceSeconds = 2.0;

  explicit EventMerger(const std::array<bool, kStreamCount>& active) : active_(active) {}

  // Stamps of a stream must increase. False: the event comes too late to be put in order and is not taken.
  bool Push(Stream stream, Timestamp stamp, RecordedEvent event);
  // No more events will come.
  void Finish() { finished_ = true; }
  // The next event whose place is settled.
  std::optional<RecordedEvent> Pop();

 private:
  struct Entry {
    Timestamp stamp;
    RecordedEvent event;
  };
  bool AllActiveStreamsWait() const;

  std::array<bool, kStreamCount> active_;
  std::array<std::deque<Entry>, kStreamCount> queues_;
  std::optional<Timestamp> newest_, last_popped_;
  bool finished_ = false;
};

}  // namespace planar_vslam::io
