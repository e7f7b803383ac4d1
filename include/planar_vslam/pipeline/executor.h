#pragma once
// Who runs a job and when. Stages are functions; this is the only place that knows threads.
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <thread>
#include <type_traits>
#include <utility>

namespace planar_vslam {

enum class Schedule { kInline, kThreaded };

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

// What the schedule runs jobs on. `niceness` of its worker.
std::unique_ptr<Executor> MakeExecutor(Schedule schedule, int niceness);

// Runs `job` on `executor`; its value comes through the future.
template <class Job>
auto Submit(Executor* executor, Job job) {
  using Value = std::invoke_result_t<Job>;
  auto task = std::make_shared<std::packaged_task<Value()>>(std::move(job));
  std::future<Value> value = task->get_future();
  executor->Submit([task] { (*task)(); });
  return value;
}

// Ends `value`, whose end waits for jobs of its own, on `executor`: the caller does not wait.
template <class Value>
void EndOn(Executor* executor, std::unique_ptr<Value> value) {
  executor->Submit([ends = std::shared_ptr<Value>(std::move(value))] {});
}

// `Future`: std::future or std::shared_future.
template <class Future>
bool IsReady(const Future& value, bool wait) {
  if (wait) value.wait();
  return value.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

}  // namespace planar_vslam
