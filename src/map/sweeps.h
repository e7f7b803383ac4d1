#pragma once
// What becomes of the laser sweeps of a keyframe that is erased: a place that is mapped again and again keeps no more
// of them than a grid has use for.
#include <vector>

#include "planar_vslam/map/map.h"

namespace planar_vslam {

// What is to be kept of the sweeps of `erased`, a keyframe about to be erased from `map`. Sweeps are alike that were
// taken at about the same place in the same direction on different visits. Where the keyframes around hold enough that
// are like a sweep, the oldest of them all goes: that one, or one of theirs, but never a keyframe's first, which links
// match.
std::vector<LaserSweep> ThinSweeps(Map* map, KeyframeId erased);

// The keyframe that takes them: the one before it (the one after it, for the first), or where that stands elsewhere by
// now, as after many rounds, the nearest. The map has another keyframe.
KeyframeId HomeForSweeps(const Map& map, KeyframeId erased);

}  // namespace planar_vslam
