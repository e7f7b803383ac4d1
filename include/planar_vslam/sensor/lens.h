#pragma once
// Lenses as sensor_msgs/CameraInfo and OpenCV write them: a name and a list of coefficients.
#include <string>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam {

// Whether images are without their lens's distortion already: by the name of their topic, or said by the user.
enum class RectifiedImages { kAuto, kYes, kNo };

struct LensText {
  std::string model;                 // distortion_model
  std::vector<double> coefficients;  // D
};

// Every coefficient, in the usual order: k1 k2 p1 p2 k3 (plumb_bob), and k4 k5 k6 (rational_polynomial), or k1 k2 k3 k4
// (equidistant).
LensText DescribeLens(const CameraModel& camera);

// Sets lens and coefficients of `camera`. plumb_bob, rational_polynomial and the empty name (drivers that never fill it
// in) take 4, 5, 8, 12 or 14 numbers, of which those beyond the eighth (thin prism, tilt) must be zero; none, or only
// zeros, is no distortion, whatever the name. equidistant (fisheye) takes 4. An error names what is not supported.
Expected<bool> SetLens(const LensText& lens, CameraModel* camera);

}  // namespace planar_vslam
