#pragma once
// Matching landmarks to keypoints by projecting them into a frame whose pose is roughly known.
#include <cstddef>
#include <vector>

#include "planar_vslam/map/map.h"
#include "planar_vslam/map/predicted_view.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam {

struct ProjectionSearchOptions {
  double radius = 4.0;    // px at octave 0; grows with the predicted octave's scale
  int max_distance = 80;  // bits
  double ratio = 0.8;     // best below ratio * second best, when both have the same octave
};

// A match that the pose did not bear out: the landmark is not where the map has it, or it is another one.
struct RefusedMatch {
  std::size_t keypoint = 0;
  LandmarkId landmark;
};

// What a frame shows of the landmarks asked for. `landmarks` has one entry per keypoint, invalid where unmatched.
struct FrameMatches {
  std::vector<LandmarkId> landmarks;
  std::vector<LandmarkId> visible;    // landmarks that should be seen: in the image, at a plausible distance and angle
  int count = 0;                      // matched keypoints
  std::vector<RefusedMatch> refused;  // once the pose has been found; a keypoint may have been matched anew since
};

// Adds matches for `candidates` (ids that no longer exist are passed over) to `matches`, leaving the keypoints that are
// already matched and the landmarks already in `matches` alone. One-to-one.
void SearchByProjection(const Map& map, const std::vector<LandmarkId>& candidates, const Rigid3& T_map_camera,
                        const CameraModel& camera, const FrameFeatures& features,
                        const ProjectionSearchOptions& options, FrameMatches* matches);

}  // namespace planar_vslam
