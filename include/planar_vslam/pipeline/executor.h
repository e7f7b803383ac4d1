#pragma once
// Who runs a job and when. Stages are functions; this is the only place that knows threads.
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

namespace planar_vslam {

class Executor {
 public:
  virtual ~Executor() = default;
  virtual void Submit(std::function<void()> job) = 0;
};

// Runs each job on the caller, at once: deterministic.
class InlineExecutor final : public Executor {
 public:
  void Submit(std::function<void()> job) override { job(); }
};

// Runs jobs in order on one thread of its own. Jobs still queued when it is destroyed are run first. `niceness`, as
// nice(1) has it, lets threads with a smaller one go first where cores are few.
class WorkerExecutor final : public Executor {
 public:
  explicit WorkerExecutor(int niceness = 0);
  ~WorkerExecutor() override;
  void Submit(std::function<void()> job) override;

 private:
  void Loop();

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> jobs_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace planar_vslam
