#include "hamming.h"

namespace planar_vslam {
namespace {

[[gnu::always_inline]] inline void ComputeDistances(const Descriptor& query, const Descriptor* descriptors,
                                                    const std::vector<int>& indices, int* distances) {
  for (std::size_t k = 0; k < indices.size(); ++k) {
    distances[k] = HammingDistance(query, descriptors[static_cast<std::size_t>(indices[k])]);
  }
}

#if defined(__x86_64__)
// The same loop, compiled for processors that count bits in one instruction (all since 2008; the baseline lacks it).
[[gnu::target("popcnt")]] void ComputeDistancesPopcnt(const Descriptor& query, const Descriptor* descriptors,
                                                      const std::vector<int>& indices, int* distances) {
  ComputeDistances(query, descriptors, indices, distances);
}
#endif

}  // namespace

void HammingDistances(const Descriptor& query, const std::vector<Descriptor>& descriptors,
                      const std::vector<int>& indices, std::vector<int>* distances) {
  distances->resize(indices.size());
#if defined(__x86_64__)
  if (__builtin_cpu_supports("popcnt")) {
    ComputeDistancesPopcnt(query, descriptors.data(), indices, distances->data());
    return;
  }
#endif
  ComputeDistances(query, descriptors.data(), indices, distances->data());
}

}  // namespace planar_vslam
