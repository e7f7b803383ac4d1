#pragma once
// From rays to a picture in grey levels, before exposure and noise.
#include <cstdint>
#include <vector>

#include "eye.h"
#include "planar_vslam/sim/sensors.h"

namespace planar_vslam::sim {

struct Picture {
  int width = 0, height = 0;
  std::vector<float> grey;             // levels, may pass 255
  std::vector<float> distance;         // m along the ray of the pixel's centre
  std::vector<std::uint32_t> surface;  // that the pixel's centre shows

  std::size_t Index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
  }
};

// One viewpoint a row. The threads do not change the result.
Picture TakePicture(const SceneImpl& scene, const RayTable& rays, const std::vector<Viewpoint>& rows, float pixel_angle,
                    int threads);

}  // namespace planar_vslam::sim
