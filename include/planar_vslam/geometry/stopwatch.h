#pragma once
// Wall-clock time of the stages of a computation. It is reported and never influences a result.
#include <chrono>
#include <vector>

namespace planar_vslam {

class Stopwatch {
 public:
  double Milliseconds() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

struct StageTime {
  const char* stage;  // like "map.triangulate": a string literal
  double ms;
};
using StageTimes = std::vector<StageTime>;  // in the order the stages ended; times of one name add up

// Writes down the stages of a computation one after the other. `times` must outlive it.
class StageClock {
 public:
  explicit StageClock(StageTimes* times) : times_(times) {}

  // Ends the stage that began with the clock or with the stage before.
  void End(const char* stage) {
    times_->push_back({stage, watch_.Milliseconds()});
    watch_ = Stopwatch();
  }

 private:
  StageTimes* times_;
  Stopwatch watch_;
};

}  // namespace planar_vslam
