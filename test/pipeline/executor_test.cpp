#include "planar_vslam/pipeline/executor.h"

#include <gtest/gtest.h>

#include <future>
#include <numeric>
#include <vector>

namespace planar_vslam {
namespace {

TEST(InlineExecutor, RunsTheJobBeforeSubmitReturns) {
  InlineExecutor executor;
  std::thread::id runner;
  executor.Submit([&runner] { runner = std::this_thread::get_id(); });
  EXPECT_EQ(runner, std::this_thread::get_id());
}

TEST(WorkerExecutor, RunsJobsInOrderOnOneOtherThread) {
  std::vector<int> order;
  std::vector<std::thread::id> runners;
  WorkerExecutor executor;
  constexpr int kJobs = 100;
  std::promise<void> done;
  for (int i = 0; i < kJobs; ++i) {
    executor.Submit([&, i] {
      order.push_back(i);
      runners.push_back(std::this_thread::get_id());
      if (i + 1 == kJobs) done.set_value();
    });
  }
  done.get_future().wait();
  std::vector<int> expected(kJobs);
  std::iota(expected.begin(), expected.end(), 0);
  EXPECT_EQ(order, expected);
  for (const std::thread::id runner : runners) {
    EXPECT_EQ(runner, runners.front());
    EXPECT_NE(runner, std::this_thread::get_id());
  }
}

TEST(WorkerExecutor, FinishesQueuedJobsOnDestruction) {
  int finished = 0;
  std::promise<void> gate;
  {
    WorkerExecutor executor;
    executor.Submit([opened = gate.get_future().share()] { opened.wait(); });
    for (int i = 0; i < 20; ++i) executor.Submit([&finished] { ++finished; });
    EXPECT_EQ(finished, 0) << "the first job holds the others up";
    gate.set_value();
  }
  EXPECT_EQ(finished, 20);
}

TEST(WorkerExecutor, EndsWhatHasToWaitWhileTheCallerGoesOn) {
  struct Waits {
    ~Waits() { *ended = go_on.wait_for(std::chrono::seconds(10)) == std::future_status::ready; }
    std::future<void> go_on;
    bool* ended;
  };
  std::promise<void> gate;
  bool ended = false;
  {
    WorkerExecutor executor;
    EndOn(&executor, std::unique_ptr<Waits>(new Waits{gate.get_future(), &ended}));
    gate.set_value();
  }
  EXPECT_TRUE(ended) << "the caller came to open the gate, and the executor waited for the end";
}

TEST(WorkerExecutor, StopsWithoutEverHavingWorked) { const WorkerExecutor executor; }

}  // namespace
}  // namespace planar_vslam
