#pragma once
// What the tracker, which takes the map for true, does not know of a pose: how far the map itself may be off there, and
// how well the mount tells the base.
#include <Eigen/Core>
#include <optional>

#include "planar_vslam/map/map.h"
#include "planar_vslam/pipeline/options.h"

namespace planar_vslam {

// How well the map knows one of its newest keyframes (map_uncertainty.h).
struct KeyframeAccuracy {
  KeyframeId keyframe;
  Rigid2 T_map_keyframe;       // as it was; the map's present pose counts where the keyframe is still there
  Eigen::Matrix3d covariance;  // of the right tangent [x, y, angle]
};

// Of a pose near that keyframe, right tangent [translation, rotation] at the pose; x, y and yaw only:
//   Sigma = Sigma_mount + Ad_o Sigma_mount Ad_o^T + Ad_k Sigma_keyframe Ad_k^T
// with the adjoints that carry a perturbation at the map's origin and at the keyframe to the pose. Zero for a map that
// is not metric. Without `accuracy`, as in a saved map, the map counts as true.
Matrix6d CovarianceOfMapAt(const Rigid3& T_map_base, const Map& map, const std::optional<KeyframeAccuracy>& accuracy,
                           const MountUncertainty& mount);

}  // namespace planar_vslam
