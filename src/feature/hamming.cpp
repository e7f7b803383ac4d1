#include "planar_vslam/feature/hamming.h"

namespace planar_vslam {
namespace {

struct CountByFields {
  [[gnu::always_inline]] static int Distance(const Descriptor& a, const Descriptor& b) { return HammingDistance(a, b); }
};

template <class Count>
[[gnu::always_inline]] inline void ComputeDistances(const Descriptor& query, const Descriptor* descriptors,
                                                    const std::vector<int>& indices, int* distances) {
  for (std::size_t k = 0; k < indices.size(); ++k) {
    distances[k] = Count::Distance(query, descriptors[static_cast<std::size_t>(indices[k])]);
  }
}

template <class Count>
[[gnu::always_inline]] inline std::pair<int, int> Nearest(const Descriptor& query,
                                                          const std::vector<Descriptor>& descriptors) {
  std::pair<int, int> nearest{0, Count::Distance(query, descriptors.front())};
  for (std::size_t k = 1; k < descriptors.size(); ++k) {
    const int distance = Count::Distance(query, descriptors[k]);
    if (distance < nearest.second) nearest = {static_cast<int>(k), distance};
  }
  return nearest;
}

#if defined(__x86_64__)
// One instruction a word in the functions below, which may use it.
struct CountByWord {
  [[gnu::always_inline]] static int Distance(const Descriptor& a, const Descriptor& b) {
    return __builtin_popcountll(a[0] ^ b[0]) + __builtin_popcountll(a[1] ^ b[1]) + __builtin_popcountll(a[2] ^ b[2]) +
           __builtin_popcountll(a[3] ^ b[3]);
  }
};

PV_TARGET_SSE42 void ComputeDistancesSse42(const Descriptor& query, const Descriptor* descriptors,
                                           const std::vector<int>& indices, int* distances) {
  ComputeDistances<CountByWord>(query, descriptors, indices, distances);
}
PV_TARGET_SSE42 std::pair<int, int> NearestSse42(const Descriptor& query, const std::vector<Descriptor>& descriptors) {
  return Nearest<CountByWord>(query, descriptors);
}
#endif

}  // namespace

void HammingDistances(const Descriptor& query, const std::vector<Descriptor>& descriptors,
                      const std::vector<int>& indices, std::vector<int>* distances, InstructionSet set) {
  distances->resize(indices.size());
#if defined(__x86_64__)
  if (set != InstructionSet::kPlain) {
    return ComputeDistancesSse42(query, descriptors.data(), indices, distances->data());
  }
#endif
  static_cast<void>(set);
  ComputeDistances<CountByFields>(query, descriptors.data(), indices, distances->data());
}

std::pair<int, int> NearestByHamming(const Descriptor& query, const std::vector<Descriptor>& descriptors,
                                     InstructionSet set) {
#if defined(__x86_64__)
  if (set != InstructionSet::kPlain) return NearestSse42(query, descriptors);
#endif
  static_cast<void>(set);
  return Nearest<CountByFields>(query, descriptors);
}

}  // namespace planar_vslam
