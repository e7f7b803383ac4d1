#pragma once
// The result of a long job on a snapshot of the map, in a form that can be carried over to the map as it is by then:
// that may have gained keyframes and landmarks, lost some, and been adjusted locally. Rebase() moves
//   - a keyframe of both so that it keeps the motion it has made since:  T' = T_after T_before^-1 T_now,
//   - a keyframe added since as one piece with the corrected keyframe it hangs on: the next one back along its odometry
//     links; without a link, as after a jump, the one that sees most of the same; else the newest corrected one,
//   - a landmark of both:  p' = p_after + R (p_now - p_before),  R the rotation of T_after T_before^-1 of its keyframe,
//   - a landmark added since with its keyframe, which is the one that created it, or else the first that observes it,
// and then repeats the structural steps of the job. Steps that name ids that are gone are passed over (map_edit.h).
// Between the snapshot and now the map must not have been scaled or moved as a whole (TransformMap).
#include <Eigen/Core>
#include <vector>

#include "planar_vslam/map/map.h"
#include "planar_vslam/map/map_edit.h"

namespace planar_vslam {

struct CorrectedKeyframe {
  KeyframeId id;
  Rigid3 T_map_before, T_map_after;  // bases
};

struct CorrectedLandmark {
  LandmarkId id;
  Eigen::Vector3d p_map_before, p_map_after;  // m
};

struct MapCorrection {
  std::vector<CorrectedKeyframe> keyframes;  // ascending
  std::vector<CorrectedLandmark> landmarks;  // ascending
  MapEdit structure;  // merged landmarks, observations, links and what left the floor, in the order they were made
};

// From a snapshot to what a job made of it: all keyframes and landmarks in both. The job added and erased no keyframes
// and added no landmarks; `structure` are its steps that set neither poses nor positions.
MapCorrection CorrectionBetween(const Map& before, const Map& after, MapEdit structure);

// On the snapshot itself the result of the job, up to rounding.
Map Rebase(Map now, const MapCorrection& correction);

}  // namespace planar_vslam
