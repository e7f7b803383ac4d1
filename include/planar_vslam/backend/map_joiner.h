#pragma once
// A map that grows beside a known one becomes one with it once both hold the same places. Each new keyframe is looked
// for in the known map; and somebody who localises there meanwhile says where it has keyframes of the growing one. All
// is tested as for maps that are merged (merge_maps.h). The growing map has all its ids above those of the known one.
#include <memory>
#include <optional>
#include <vector>

#include "planar_vslam/backend/map_correction.h"
#include "planar_vslam/backend/merge_maps.h"

namespace planar_vslam {

// Where the known map has a keyframe of the growing one, by who localises in it.
struct Meeting {
  Timestamp keyframe;  // its stamp
  Rigid3 T_known_base;
};

struct MapJunction {
  std::shared_ptr<const Map> map;  // both, in the frame of the known one
  MapCorrection correction;        // from the union of the known map and the snapshot to `map`
  MapAlignment alignment;
  BundleSummary bundle;
};

class MapJoiner {
 public:
  MapJoiner(std::shared_ptr<const Map> known, const MapperContext& context)
      : known_(std::move(known)), context_(context), seeker_(known_, context_) {}

  // The snapshot joined with the known map; nothing as long as they do not agree. Error: which step of joining has no
  // solution.
  Expected<std::optional<MapJunction>> Try(const Map& snapshot, const std::vector<Meeting>& meetings);

 private:
  void LookForNew(const Map& snapshot);
  std::vector<SharedPlace> PlacesOf(const Map& snapshot, const std::vector<Meeting>& meetings) const;

  std::shared_ptr<const Map> known_;
  MapperContext context_;
  PlaceSeeker seeker_;
  std::vector<SharedPlace> found_;  // by their images alone
  KeyframeId next_{0};              // that was not looked for yet
  std::size_t tried_ = 0;           // places and meetings, the last time
};

}  // namespace planar_vslam
