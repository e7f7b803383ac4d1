#pragma once
// Two maps as one: their ids apart, side by side in one frame. Nothing is said of where they overlap
// (backend/merge_maps.h).
#include <cstdint>

#include "planar_vslam/map/map_edit.h"

namespace planar_vslam {

// What makes a map that has none of these ids hold all of `map` too, every keyframe's and landmark's id raised by so
// much; counters, links and sweeps go along.
MapEdit AdditionOf(const Map& map, std::uint32_t keyframe_offset, std::uint32_t landmark_offset);

// The same map with its ids raised: all above those given out in `below`.
Map RenumberedAbove(const Map& below, const Map& map);

// Both. The ids of `upper` are all above those given out in `lower`; both have the same octaves, and lengths in metres
// or not.
Map UnionOf(const Map& lower, const Map& upper);

}  // namespace planar_vslam
