#pragma once
// Splits the rows of a picture over threads. What a row becomes must not depend on the others.
#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace planar_vslam::sim {

// Calls body(row) for every row once; the caller's thread works too.
template <class Body>
void ForEachRow(int threads, int rows, const Body& body) {
  constexpr int kTogether = 8;  // rows taken at once
  std::atomic<int> next{0};
  const auto work = [&] {
    for (int first = next.fetch_add(kTogether); first < rows; first = next.fetch_add(kTogether)) {
      for (int row = first; row < std::min(rows, first + kTogether); ++row) body(row);
    }
  };
  std::vector<std::thread> helpers;
  for (int i = 1; i < threads; ++i) helpers.emplace_back(work);
  work();
  for (std::thread& helper : helpers) helper.join();
}

}  // namespace planar_vslam::sim
