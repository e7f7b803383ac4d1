#pragma once
// All the ways a map can change, as values. Apply() carries a list out in order, keeps references in both directions,
// erases landmarks that lost observations and are left with fewer than two (unless created in the same edit; one that
// loses its last is gone at once), and then recomputes the derived fields of every landmark it touched, once: all of
// them where the observations changed, view direction and distances where the point or a camera that sees it moved.
#include <variant>
#include <vector>

#include "planar_vslam/map/map.h"

namespace planar_vslam {

// Ids are given by the caller: KeyframeId{map.next_keyframe_id}, ... ; Apply advances the counters past them.
// `keyframe.landmarks` has an entry per keypoint and may already refer to existing landmarks: the observations are
// added on their side too. The odometry link is dropped when its keyframe is gone.
struct AddKeyframe {
  KeyframeId id;
  Keyframe keyframe;
};
// Observations must name existing keyframes (or ones added before in the same edit) and free keypoints.
struct AddLandmark {
  LandmarkId id;
  Landmark landmark;
};
// Ignored when the keyframe already observes the landmark or the keypoint is taken.
struct AddObservation {
  LandmarkId landmark;
  Observation observation;
};
struct EraseObservation {
  LandmarkId landmark;
  KeyframeId keyframe;
};
struct EraseLandmarks {
  std::vector<LandmarkId> ids;
};
// Its observations go; the odometry link of a later keyframe that pointed at it is re-composed across it, or
// dropped when it has no link itself. Its laser sweeps go to the keyframe before it (the one after it, for the first),
// or the nearest where that one is far, and stay where they were in the map. They are dropped with the last keyframe;
// of those taken at a place on visit after visit the oldest are dropped (src/map/sweeps.h). Laser links across it are
// re-composed like odometry links where there is one to continue from, and dropped else.
struct EraseKeyframe {
  KeyframeId id;
};
// `from` disappears into `into`: observations move unless `into` is already seen there; counters add up.
// Position and `created_by` stay those of `into`.
struct MergeLandmarks {
  LandmarkId from;
  LandmarkId into;
};
struct AddSweeps {
  KeyframeId keyframe;
  std::vector<LaserSweep> sweeps;
};
// Links from keyframes that do not exist or are not earlier, and second ones from the same keyframe, are passed over.
struct AddLaserLinks {
  KeyframeId keyframe;
  std::vector<MotionLink> links;
};
// What the wheels said of the way here turned out to be wrong: the robot was kidnapped.
struct EraseOdometryLink {
  KeyframeId keyframe;
};
// What the wheels measured between keyframes from `first` on, with every length and turn multiplied: twists of
// increments are, and so is that of the whole way. `noise`: and their standard deviations, by that.
struct CorrectOdometryLinks {
  KeyframeId first;
  double length = 1.0, turn = 1.0;
  WheelNoise noise = {};
};
struct SetKeyframePose {
  KeyframeId id;
  Rigid3 T_map_base;
};
// All images were taken so many seconds after their stamps: where a keyframe's velocity is known, its base moves under
// the camera (image_moment.h).
struct SetImageOffset {
  double offset = 0.0;
};
// The floor prior is withdrawn from keyframes that turned out not to have been on the floor.
struct SetOffFloor {
  std::vector<KeyframeId> ids;
};
struct SetLandmarkPosition {
  LandmarkId id;
  Eigen::Vector3d p_map;
};
// Frames that should have seen landmarks, and those that did (sorted or not, repeats count).
struct CountSightings {
  std::vector<LandmarkId> predicted_visible;
  std::vector<LandmarkId> found;
};
// p_map' = T * (scale * p_map), cameras likewise: camera centres and points scale, T_base_camera stays metric.
// Keyframe poses become (T * Scaled(T_map_camera)) * T_base_camera^-1.
struct TransformMap {
  double scale = 1.0;
  Rigid3 T_new_old;
};
struct SetMetric {
  bool metric = true;
};

using MapEditStep =
    std::variant<AddKeyframe, AddLandmark, AddObservation, EraseObservation, EraseLandmarks, EraseKeyframe,
                 MergeLandmarks, AddSweeps, AddLaserLinks, EraseOdometryLink, CorrectOdometryLinks, SetKeyframePose,
                 SetImageOffset, SetOffFloor, SetLandmarkPosition, CountSightings, TransformMap, SetMetric>;
using MapEdit = std::vector<MapEditStep>;

// Steps naming ids that no longer exist are passed over (the map may have moved on since the edit was made), except
// that added ids must be new.
Map Apply(Map map, const MapEdit& edit);

}  // namespace planar_vslam
