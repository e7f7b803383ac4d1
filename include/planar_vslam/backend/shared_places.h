#pragma once
// The places of one map in another: keyframes of a map that were taken where a known map was made, each found for
// itself by the one verifier (place.h). Images alone do not tell aisles apart that look alike, so where both maps have
// laser sweeps of a place, these have to agree as well. One such place proves nothing; map_alignment.h asks for
// several.
#include <memory>
#include <optional>
#include <vector>

#include "planar_vslam/backend/map_keyframe.h"
#include "planar_vslam/recognition/place.h"
#include "planar_vslam/recognition/place_index.h"

namespace planar_vslam {

struct SharedPlace {
  KeyframeId known;       // of the known map, one that sees the same
  KeyframeId keyframe;    // of the other map
  Rigid3 T_known_base;    // of the latter, in the known map
  Rigid3 T_other_base;    // ...and where its own map has it
  FrameMatches matches;   // with landmarks of the known map, inliers only; none where sweeps alone tell
  bool by_laser = false;  // sweeps of both maps agree
};

// What a keyframe says of a pose in the known map.
struct PlaceTest {
  std::optional<SharedPlace> place;  // it was taken there
  bool should_see = false;           // much of the known map should be in view...
  bool sees = false;                 // ...and is
  bool has_sweeps = false;           // both maps have laser sweeps there...
  bool sweeps_agree = false;         // ...that agree
};

class PlaceSeeker {
 public:
  // `known` metric, with keyframes.
  PlaceSeeker(std::shared_ptr<const Map> known, const MapperContext& context);

  // Where in the known map the keyframe was taken, anywhere in it. Nothing where two places explain it.
  std::optional<SharedPlace> Find(KeyframeId id, const Keyframe& keyframe) const;
  // Where else than at `places`, whose keyframes are of `other`, these might have been taken: what they show there is
  // left out of the search.
  std::vector<SharedPlace> FindElsewhere(const Map& other, const std::vector<SharedPlace>& places) const;
  // Whether it was taken at about `T_known_base`.
  PlaceTest TestAt(KeyframeId id, const Keyframe& keyframe, const Rigid3& T_known_base) const;

 private:
  struct LaserWord {
    bool has_sweeps = false, agrees = false;
    std::optional<SharedPlace> place;  // where the sweeps match in all directions
  };
  std::optional<SharedPlace> FindBy(const PlaceIndex& index, KeyframeId id, const Keyframe& keyframe) const;
  CameraView ViewOf(const Keyframe& keyframe) const;
  std::optional<KeyframeId> SeesTheSame(const Placement& placement) const;
  LaserWord AskLaser(KeyframeId id, const Keyframe& keyframe, const Rigid3& T_known_base) const;

  std::shared_ptr<const Map> known_;
  MapperContext context_;
  PlaceIndex index_;
};

}  // namespace planar_vslam
