#pragma once
// Two maps of one building become one: places of the one are found in the other (shared_places.h), agree on where it
// lies there (map_alignment.h), and are laid on each other: a pose graph spreads what either has drifted, landmarks
// that both hold become one, sweeps that stand side by side are linked, and bundle adjustment of everything follows.
// Both maps are metric, and lengths stay.
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "planar_vslam/backend/map_alignment.h"
#include "planar_vslam/backend/shared_places.h"
#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/map/map_edit.h"

namespace planar_vslam {

// Of a long job: what it does, and how much of that is done.
using MergeProgress = std::function<void(const std::string& what, long done, long total)>;

// Where `other` lies in the known map, and the places that say so.
struct MapOverlap {
  MapAlignment alignment;           // its `places` are all of those below
  std::vector<SharedPlace> places;  // ascending by keyframe
};

// Every keyframe of `other` is looked for. Error: why the maps do not overlap, as far as they show.
Expected<MapOverlap> FindOverlap(const PlaceSeeker& seeker, const Map& other, const MergeProgress& progress);
// The same from places that were found already.
Expected<MapOverlap> OverlapOf(const PlaceSeeker& seeker, const Map& other, const std::vector<SharedPlace>& found,
                               const MergeProgress& progress);

struct JoinedMap {
  Map map;
  MapEdit structure;  // what was done to it beside moving keyframes and landmarks, in order
  BundleSummary bundle;
};

// `united` holds the known map and, with the keyframe ids from `first` on, the other one, which is moved to where
// `overlap` has it. Error: which step has no solution.
Expected<JoinedMap> JoinAt(const Map& united, KeyframeId first, const MapOverlap& overlap, const MapperContext& context,
                           const MergeProgress& progress);

struct MergedMap {
  Map map;
  MapOverlap overlap;
  KeyframeId first_other;    // keyframes from here on are those of the second map
  int landmarks_shared = 0;  // seen by keyframes of both
  int laser_links = 0;       // from keyframes of one to those of the other
  BundleSummary bundle;
};

// Ids of `known` stay; those of `other` are raised above them.
Expected<MergedMap> MergeMaps(const std::shared_ptr<const Map>& known, const Map& other, const MapperContext& context,
                              const MergeProgress& progress);

}  // namespace planar_vslam
