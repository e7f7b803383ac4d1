#pragma once
// The queue between callbacks and tracking, and the thread that works it off.
#include <functional>
#include <future>
#include <memory>
#include <thread>

#include "input_queue.h"
#include "tracking_loop.h"

namespace planar_vslam::ros_face {

class TrackingThread {
 public:
  // `after_input` runs on the thread, after each input.
  TrackingThread(const NodeSettings& settings, const std::string& image_topic, TrackingEvents events,
                 std::function<void(const TrackingLoop&)> after_input)
      : queue_(static_cast<std::size_t>(settings.queue_size_images), settings.lossless),
        loop_(settings, image_topic, std::move(events)),
        after_input_(std::move(after_input)) {}
  ~TrackingThread() { Stop(); }
  TrackingThread(const TrackingThread&) = delete;
  TrackingThread& operator=(const TrackingThread&) = delete;

  void Start() {
    thread_ = std::thread([this] { Run(); });
  }
  // Input that waits is discarded; whoever asks gets std::future_error.
  void Stop() {
    queue_.Close();
    if (thread_.joinable()) thread_.join();
  }
  void Push(Input input) { queue_.Push(std::move(input)); }

  // What `ask` gives on the thread; throws std::future_error when it stops before.
  template <class Value>
  Value Ask(std::function<Value(TrackingLoop&)> ask) {
    auto answer = std::make_shared<std::promise<Value>>();
    std::future<Value> future = answer->get_future();
    queue_.Push(Command([this, ask = std::move(ask), answer = std::move(answer)] { answer->set_value(ask(loop_)); }));
    return future.get();
  }

  const InputQueue& queue() const { return queue_; }

 private:
  void Run() {
    while (const std::optional<Input> input = queue_.Pop()) {
      loop_.Handle(*input);
      after_input_(loop_);
    }
  }

  InputQueue queue_;
  TrackingLoop loop_;
  const std::function<void(const TrackingLoop&)> after_input_;
  std::thread thread_;
};

}  // namespace planar_vslam::ros_face
