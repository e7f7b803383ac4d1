#pragma once
// Was this view taken there? The one answer to it, for tracker and loop finder.
//
// A view is placed by landmarks of the map: matched by descriptors alone (Recognize), or projected into it from a guess
// of its pose (Verify), and its pose adjusted to those matches with outliers taken out. No motion takes part: what
// odometry or map say of the pose is for the caller to compare.
#include <optional>
#include <vector>

#include "planar_vslam/map/map.h"
#include "planar_vslam/optimize/pose_only.h"
#include "planar_vslam/recognition/place_limits.h"
#include "planar_vslam/recognition/projection_search.h"

namespace planar_vslam {

// An image, how it was taken, and what it is measured with.
struct CameraView {
  FrameFeaturesPtr features;
  Rigid3 T_base_camera;
  CameraModel camera;
  PlanarPriorOptions planar;  // what the floor says of the base; mode kOff where it may have left it
  double pixel_sigma = 1.0;   // px at octave 0; grows with the octave's scale
};

// Where a view was taken, and what it shows there.
struct Placement {
  Rigid3 T_map_base;
  Matrix6d covariance = Matrix6d::Identity();  // of a right perturbation [translation, rotation]
  FrameMatches matches;                        // inliers only

  // Whether it shows at least this share of the landmarks that should be in view.
  bool Shows(double share) const { return matches.count >= share * static_cast<double>(matches.visible.size()); }
};

// By descriptors and PnP against what `keyframe` sees. Nothing where fewer than PlaceLimits::kMinInliers agree.
// `visible` stays empty.
std::optional<Placement> Recognize(const Map& map, const CameraView& view, KeyframeId keyframe);

// By `landmarks`, projected from the guess `T_map_base` in a wide window and once more, in a narrow one, from the pose
// found. Nothing where fewer than PlaceLimits::kMinInliers remain.
std::optional<Placement> Verify(const Map& map, const CameraView& view, const std::vector<LandmarkId>& landmarks,
                                const Rigid3& T_map_base);
// The same without a guess: PnP against `keyframe` is the guess.
std::optional<Placement> Verify(const Map& map, const CameraView& view, const std::vector<LandmarkId>& landmarks,
                                KeyframeId keyframe);

// Its parts, for who adds a prior of odometry to the problem.

// The matched landmarks, by keypoint.
std::vector<PoseObservation> ObservationsOf(const Map& map, const CameraView& view, const FrameMatches& matches);
// The pose of the view, started at `T_map_base`.
PoseOnlyProblem PoseProblem(const CameraView& view, const Rigid3& T_map_base);
// Takes those out of `matches` that are no inliers of `observations`, which were made of them.
void KeepInliers(const std::vector<PoseObservation>& observations, FrameMatches* matches);
Matrix6d CovarianceOf(const PoseOnlyResult& pose);

}  // namespace planar_vslam
