#pragma once
// When an image was taken, as far as a later estimate of the images' clock may change it (pipeline/image_clock.h).
#include <Eigen/Core>

#include "planar_vslam/geometry/rigid3.h"

namespace planar_vslam {

struct ImageMoment {
  // Of the base around the stamp, [m/s, m/s, rad/s] in its own axes; zero where nothing tells.
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  double offset = 0.0;  // s, from the stamp to the moment that T_base_camera is of
};

// E with T_base_camera' = E T_base_camera, if the image was taken `offset` after its stamp:
//   E = Exp(velocity (offset - moment.offset)).
// The view told where the camera was, so that stays in the map and the base moves: T_map_base' = T_map_base E^-1.
inline Rigid3 MountShift(const ImageMoment& moment, double offset) {
  return Embed3(ExpSe2(moment.velocity * (offset - moment.offset)));
}

}  // namespace planar_vslam
