#pragma once
// Descriptor distances in bulk, with the processor's bit counter where it has one.
#include <utility>
#include <vector>

#include "planar_vslam/feature/features.h"
#include "planar_vslam/feature/instruction_set.h"

namespace planar_vslam {

// distances[k] = HammingDistance(query, descriptors[indices[k]]).
void HammingDistances(const Descriptor& query, const std::vector<Descriptor>& descriptors,
                      const std::vector<int>& indices, std::vector<int>* distances,
                      InstructionSet set = BestInstructionSet());

// Index of the descriptor nearest to `query`, the smaller one on ties, and its distance. `descriptors` is not empty.
std::pair<int, int> NearestByHamming(const Descriptor& query, const std::vector<Descriptor>& descriptors,
                                     InstructionSet set = BestInstructionSet());

}  // namespace planar_vslam
