#pragma once
// Pose of an image in the map with no idea where the camera is, against one keyframe: its descriptors matched to those
// of the landmarks the keyframe sees, PnP in RANSAC (limits: place_limits.h).
#include <optional>

#include "planar_vslam/map/map.h"
#include "planar_vslam/recognition/projection_search.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam {

// Camera pose and matches; nothing when they do not agree on one.
struct RelocalizationHypothesis {
  Rigid3 T_map_camera;
  FrameMatches matches;  // inliers only; `visible` is empty
};
std::optional<RelocalizationHypothesis> RelocalizeAgainst(const Map& map, KeyframeId keyframe,
                                                          const FrameFeatures& features, const CameraModel& camera);

}  // namespace planar_vslam
