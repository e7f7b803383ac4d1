#pragma once
// The landmarks that are good enough for a navigation map, and what each is good for.
#include <map>

#include "planar_vslam/pipeline/navigation_map.h"

namespace planar_vslam {

struct AcceptedLandmark {
  double relative_sigma = 0.0;  // of the depth, over the distance
  double least_sigma = 0.0;     // m, of the depth from the nearest observer
  bool blocks = false;          // good enough for an obstacle where the depth is; else rays to it clear only
};

struct AcceptedLandmarks : std::map<LandmarkId, AcceptedLandmark> {};

// `hit_sigma`: m, depth sigma up to which a landmark may block.
AcceptedLandmarks AcceptLandmarks(const Map& map, const CameraModel& camera, const LandmarkAcceptance& acceptance,
                                  double hit_sigma);

}  // namespace planar_vslam
