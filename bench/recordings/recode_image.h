#pragma once
// Grey images as the drivers of other cameras send them.
#include <sensor_msgs/Image.h>

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace planar_vslam::bench {

// Names of what ToImage can make.
std::vector<std::string> ImageForms();

// Encoding, step, byte order and data; size and header are the caller's. Stops where the form is not known.
void ToImage(const cv::Mat& grey, const std::string& form, sensor_msgs::Image* image);

}  // namespace planar_vslam::bench
