#pragma once
// What a sweep must be before it is believed.
#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

// Whether the sweep says how far its laser sees: drivers that never fill in range_max leave 0.
bool StatesRange(const PlanarScan& scan);

// The sweep as the rest of the program may take it: every field finite, 0 <= range_min < range_max, and a range that
// measured nothing is NaN. A laser that does not say how far it sees is taken for one that sees any distance; its beams
// without return then say nothing. An error (what is wrong, without values) where directions make no sense: no ranges,
// or angles that are not finite or go round more than once.
Expected<PlanarScan> CheckedScan(PlanarScan scan);

}  // namespace planar_vslam
