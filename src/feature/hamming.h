#pragma once
// Descriptor distances in bulk, with the processor's bit counter where it has one.
#include <vector>

#include "planar_vslam/feature/features.h"

namespace planar_vslam {

// distances[k] = HammingDistance(query, descriptors[indices[k]]).
void HammingDistances(const Descriptor& query, const std::vector<Descriptor>& descriptors,
                      const std::vector<int>& indices, std::vector<int>* distances);

}  // namespace planar_vslam
