#pragma once
// Descriptor distances in bulk, with the processor's bit counter where it has one.
#include <utility>
#include <vector>

#include "instruction_set.h"
#include "planar_vslam/feature/features.h"

namespace planar_vslam {

// distances[k] = HammingDistance(query, descriptors[indices[k]]).
void HammingDistances(InstructionSet set, const Descriptor& query, const std::vector<Descriptor>& descriptors,
                      const std::vector<int>& indices, std::vector<int>* distances);

// Index of the descriptor nearest to `query`, the smaller one on ties, and its distance. `descriptors` is not empty.
std::pair<int, int> NearestByHamming(InstructionSet set, const Descriptor& query,
                                     const std::vector<Descriptor>& descriptors);

}  // namespace planar_vslam
