#pragma once
// What a frame showed of the map, for people to look at.
#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <vector>

#include "planar_vslam/frontend/tracker.h"
#include "planar_vslam/sensor/camera_model.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

struct FrameView {
  // Seen here, while by the pose its landmark should show there (px of the real image): something has moved, or looks
  // like something else.
  struct Refused {
    std::size_t keypoint = 0;
    Eigen::Vector2d expected = Eigen::Vector2d::Zero();
  };

  GrayImage image;                    // shared with whoever has it
  FrameFeaturesPtr features;          // null before the first frame
  std::vector<std::size_t> followed;  // keypoints that show landmarks the pose was found by, ascending
  std::vector<Refused> refused;
};

// `map`: that the frame was tracked in; null while there is none.
FrameView ViewOf(const GrayImage& image, const FrameFeaturesPtr& features, const TrackResult& track,
                 const Rigid3& T_base_camera, const CameraModel& camera, const Map* map);

}  // namespace planar_vslam
