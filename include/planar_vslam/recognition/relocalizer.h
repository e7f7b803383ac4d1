#pragma once
// Pose of a frame in the map with no idea where the camera is: keyframes that look like it, descriptor matching to the
// landmarks each of them sees, PnP in RANSAC.
#include <optional>
#include <vector>

#include "planar_vslam/map/map.h"
#include "planar_vslam/recognition/projection_search.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam {

struct RelocalizerOptions {
  int min_matches = 15;
  int min_inliers = 12;       // of PnP
  double reprojection = 4.0;  // px at octave 0
  int ransac_iterations = 100;
};

// Camera pose and matches against `keyframe`; nothing when they do not agree on one.
struct RelocalizationHypothesis {
  Rigid3 T_map_camera;
  FrameMatches matches;
};
std::optional<RelocalizationHypothesis> RelocalizeAgainst(const Map& map, KeyframeId keyframe,
                                                          const FrameFeatures& features, const CameraModel& camera,
                                                          const RelocalizerOptions& options);

// The keyframes of the whole map that look most like the frame, at most `limit`, best first: each keypoint votes for
// the keyframes that see the landmark nearest to it in appearance.
std::vector<KeyframeId> KeyframesResembling(const Map& map, const FrameFeatures& features, std::size_t limit);
// The same with a choice of landmarks, all in the map.
std::vector<KeyframeId> KeyframesResembling(const Map& map, const FrameFeatures& features,
                                            const std::vector<LandmarkId>& among, std::size_t limit);

}  // namespace planar_vslam
