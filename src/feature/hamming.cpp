#include "hamming.h"

namespace planar_vslam {
namespace {

[[gnu::always_inline]] inline void ComputeDistances(const Descriptor& query, const Descriptor* descriptors,
                                                    const std::vector<int>& indices, int* distances) {
  for (std::size_t k = 0; k < indices.size(); ++k) {
    distances[k] = HammingDistance(query, descriptors[static_cast<std::size_t>(indices[k])]);
  }
}

[[gnu::always_inline]] inline std::pair<int, int> Nearest(const Descriptor& query,
                                                          const std::vector<Descriptor>& descriptors) {
  std::pair<int, int> nearest{0, HammingDistance(query, descriptors.front())};
  for (std::size_t k = 1; k < descriptors.size(); ++k) {
    const int distance = HammingDistance(query, descriptors[k]);
    if (distance < nearest.second) nearest = {static_cast<int>(k), distance};
  }
  return nearest;
}

#if defined(__x86_64__)
// The same loops, compiled for processors that count bits in one instruction (all since 2008; the baseline lacks it).
[[gnu::target("popcnt")]] void ComputeDistancesPopcnt(const Descriptor& query, const Descriptor* descriptors,
                                                      const std::vector<int>& indices, int* distances) {
  ComputeDistances(query, descriptors, indices, distances);
}
[[gnu::target("popcnt")]] std::pair<int, int> NearestPopcnt(const Descriptor& query,
                                                            const std::vector<Descriptor>& descriptors) {
  return Nearest(query, descriptors);
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

std::pair<int, int> NearestByHamming(const Descriptor& query, const std::vector<Descriptor>& descriptors) {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("popcnt")) return NearestPopcnt(query, descriptors);
#endif
  return Nearest(query, descriptors);
}

}  // namespace planar_vslam
