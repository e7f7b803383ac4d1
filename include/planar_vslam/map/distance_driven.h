#pragma once
// How far the robot drove between the keyframes of a map: what tells a place seen again from one seen still.
#include <vector>

#include "planar_vslam/map/map.h"

namespace planar_vslam {

class DistanceDriven {
 public:
  // m driven, after which seeing the same is a return.
  static constexpr double kReturn = 5.0;

  // The map must outlive it.
  explicit DistanceDriven(const Map& map);

  // m from the one to the later other, keyframe by keyframe.
  double Between(KeyframeId earlier, KeyframeId later) const { return driven_[later.value] - driven_[earlier.value]; }
  // Whether the last keyframe to see the landmark is one that `later` returns to.
  bool IsOld(const Landmark& landmark, KeyframeId later) const {
    return Between(landmark.observations.back().keyframe, later) > kReturn;
  }
  // Whether the keyframe stands in a place the robot returned to: most of what it sees was seen there before.
  bool HasReturned(const Keyframe& keyframe) const;

 private:
  bool HasReturned(const Landmark& landmark) const;

  const Map& map_;
  std::vector<double> driven_;  // m since the first keyframe, by id
};

}  // namespace planar_vslam
