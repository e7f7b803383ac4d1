#include "planar_vslam/pipeline/map_accuracy.h"

#include "planar_vslam/geometry/tangent_parts.h"

namespace planar_vslam {

Matrix6d CovarianceOfMapAt(const Rigid3& T_map_base, const Map& map, const std::optional<KeyframeAccuracy>& accuracy,
                           const MountUncertainty& mount) {
  Matrix6d covariance = Matrix6d::Zero();
  if (!map.metric) return covariance;
  const double position = mount.position * mount.position;
  const Eigen::Matrix3d at_mount = Eigen::Vector3d(position, position, mount.angle * mount.angle).asDiagonal();
  const Rigid2 T_map_frame = ProjectToPlane(T_map_base);
  const Eigen::Matrix3d from_origin = AdjointSe2(T_map_frame.Inverse());
  Eigen::Matrix3d planar = at_mount + from_origin * at_mount * from_origin.transpose();
  if (accuracy.has_value()) {
    const Keyframe* keyframe = map.keyframes.Find(accuracy->keyframe);
    const Rigid2 T_map_keyframe = keyframe != nullptr ? ProjectToPlane(keyframe->T_map_base) : accuracy->T_map_keyframe;
    const Eigen::Matrix3d from_keyframe = AdjointSe2(T_map_frame.Inverse() * T_map_keyframe);
    planar += from_keyframe * accuracy->covariance * from_keyframe.transpose();
  }
  covariance(kPlanarRows, kPlanarRows) = planar;
  return covariance;
}

}  // namespace planar_vslam
