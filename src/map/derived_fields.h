#pragma once
// The fields of a landmark that follow from its observations (see map.h), recomputed one landmark at a time.
#include <Eigen/Core>
#include <vector>

#include "planar_vslam/map/map.h"

namespace planar_vslam {

// The descriptor among those observed with the least median distance to the others; ties go to the earliest
// observation.
Descriptor MedoidDescriptor(const std::vector<Descriptor>& descriptors);

// Reads a map that outlives it.
class DerivedFields {
 public:
  explicit DerivedFields(const Map& map) : map_(map) {}

  void UpdateDescriptor(Landmark* landmark);
  // View direction and distance range. The reference is the creating keyframe's observation, or the first once that is
  // gone. A patch it saw on level o from distance d shows on level 0 from d * scale[o] = max_distance, and on the last
  // level from max_distance / scale.back() = min_distance.
  void UpdateGeometry(Landmark* landmark) const;

 private:
  Eigen::Vector3d CameraCenter(KeyframeId id) const;

  const Map& map_;
  std::vector<Descriptor> descriptors_;  // of one landmark, reused from call to call
};

}  // namespace planar_vslam
