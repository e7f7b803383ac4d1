#include "planar_vslam/pipeline/executor.h"

#include <sys/resource.h>

#include <utility>

namespace planar_vslam {

std::unique_ptr<Executor> MakeExecutor(Schedule schedule, int niceness) {
  if (schedule == Schedule::kInline) return std::make_unique<InlineExecutor>();
  return std::make_unique<WorkerExecutor>(niceness);
}

WorkerExecutor::WorkerExecutor(int niceness)
    : thread_([this, niceness] {
        // Of this thread alone, as Linux has it; where that is refused, all are equals.
        if (niceness > 0) setpriority(PRIO_PROCESS, 0, niceness);
        Loop();
      }) {}

WorkerExecutor::~WorkerExecutor() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void WorkerExecutor::Submit(std::function<void()> job) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    jobs_.push_back(std::move(job));
  }
  wake_.notify_one();
}

void WorkerExecutor::Loop() {
  while (true) {
    std::function<void()> job;
    {
      std::unique_lock<std::mutex> lock(mutex_);
      wake_.wait(lock, [this] { return stopping_ || !jobs_.empty(); });
      if (jobs_.empty()) return;
      job = std::move(jobs_.front());
      jobs_.pop_front();
    }
    job();
  }
}

}  // namespace planar_vslam
