#pragma once
// Comparing maps.
#include "planar_vslam/map/map.h"

namespace planar_vslam::test {

// The same keyframes and landmarks, references and links, and places that differ by rounding only.
void ExpectSameMap(const Map& a, const Map& b);

}  // namespace planar_vslam::test
