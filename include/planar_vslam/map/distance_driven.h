#pragma once
// How far the robot drove between the keyframes of a map: what tells a place seen again from one seen still.
#include <vector>

#include "planar_vslam/map/map.h"

namespace planar_vslam {

class DistanceDriven {
 public:
  // m driven, after which seeing the same is a return.
  static constexpr double kReturn = 5.0;

  DistanceDriven() = default;
  explicit DistanceDriven(const Map& map) { Follow(map, KeyframeId{0}); }

  // Goes on to a later state of the map, in which keyframes before `first` stand where they stood. Returns how much, at
  // most, the distance between any two keyframes of both has changed, m.
  double Follow(const Map& map, KeyframeId first);

  // m from the one to the later other, keyframe by keyframe.
  double Between(KeyframeId earlier, KeyframeId later) const { return driven_[later.value] - driven_[earlier.value]; }
  bool IsReturn(KeyframeId earlier, KeyframeId later) const { return Between(earlier, later) > kReturn; }
  // Whether the last keyframe to see the landmark is one that `later` returns to.
  bool IsOld(const Landmark& landmark, KeyframeId later) const {
    return IsReturn(landmark.observations.back().keyframe, later);
  }
  // Whether the keyframe stands in a place the robot returned to: most of what it sees was seen there before.
  // `slack`, where given, falls to how near to kReturn a distance is that was asked for.
  bool HasReturned(const Map& map, const Keyframe& keyframe, double* slack = nullptr) const;

 private:
  std::vector<double> driven_;  // m since the first keyframe, by id; NaN where there is none
};

}  // namespace planar_vslam
