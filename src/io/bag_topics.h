#pragma once
// Which topics of a bag are the robot's sensors.

#include <string>
#include <vector>

#include "bag_files.h"
#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/io/message_values.h"
#include "planar_vslam/io/recording.h"

namespace planar_vslam::io {

struct BagTopics {
  std::string image;
  bool image_compressed = false;
  std::string camera_info;
  std::string odometry;                    // nav_msgs/Odometry; empty: none
  std::string scan;                        // empty: none
  std::vector<std::string> tf;             // tf and tf_static
  std::vector<std::string> like_odometry;  // with their types: say how the robot moves, and are not read
};

// `file` is named in errors.
Expected<BagTopics> ChooseTopics(const Bags& bags, const std::string& file, const BagOptions& options);

bool IsStaticTf(const std::string& topic);

}  // namespace planar_vslam::io
