#pragma once
// What tracking saw in a frame, as a picture for people.
#include <cstdint>
#include <string>
#include <vector>

#include "planar_vslam/pipeline/frame_view.h"

namespace planar_vslam::io {

struct ColorImage {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> bgr;  // width * height * 3 values, row-major
};

// The image with a point for each keypoint: green where the pose was found by it, red with a line to where it was
// expected where the pose refused it, grey otherwise. Below it a line for each of `text`. Empty where the view is.
ColorImage DrawFrame(const FrameView& view, const std::vector<std::string>& text);

}  // namespace planar_vslam::io
