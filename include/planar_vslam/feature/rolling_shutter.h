#pragma once
// Images whose rows were taken one after the other. A row v of an image of height h is exposed
//   dt(v) = readout (v - h / 2) / h
// after the middle row, whose moment the image stands for. While the camera turns by w (rad/s, in its own axes) a ray
// seen at dt points, in the axes of the middle row's camera,
//   r_middle = Exp(w dt) r_row,
// which is where its keypoint is put. What the camera's own way moves a point by meanwhile hangs on its depth and
// stays: at a walking robot's 0.4 m/s and 20 ms it is a pixel at the image's edge for points 2 m away, where a turn of
// 1 rad/s makes ten.
#include "planar_vslam/feature/features.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam {

// The same features as if all rows had been taken at once. `readout` in s from the first row to the last, negative
// where the last comes first. They stay as they are where the camera would have turned by more than 0.2 rad meanwhile.
FrameFeatures WithoutRolling(FrameFeatures features, const CameraModel& camera, const Eigen::Vector3d& turn_rate,
                             double readout);

}  // namespace planar_vslam
