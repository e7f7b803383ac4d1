#include "planar_vslam/pipeline/frame_view.h"

namespace planar_vslam {

FrameView ViewOf(const GrayImage& image, const FrameFeaturesPtr& features, const TrackResult& track,
                 const Rigid3& T_base_camera, const CameraModel& camera, const Map* map) {
  FrameView view{image, features, {}, {}};
  if (map == nullptr || track.status == TrackingState::kLost) return view;
  const std::vector<LandmarkId>& landmarks = track.matches.landmarks;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    if (landmarks[i].valid()) view.followed.push_back(i);
  }
  const Rigid3 T_camera_map = (track.T_map_base * T_base_camera).Inverse();
  for (const RefusedMatch& refused : track.matches.refused) {
    if (refused.keypoint < landmarks.size() && landmarks[refused.keypoint].valid()) continue;  // matched anew
    const Landmark* landmark = map->landmarks.Find(refused.landmark);
    if (landmark == nullptr) continue;
    const Eigen::Vector3d p_camera = T_camera_map * landmark->p_map;
    if (p_camera.z() > 0.0) view.refused.push_back({refused.keypoint, camera.Project(p_camera)});
  }
  return view;
}

}  // namespace planar_vslam
