#pragma once
// The tf of a bag, read in one pass before the rest, reduced to the ways between the base and its sensors.

#include <optional>
#include <string>
#include <vector>

#include "bag_files.h"
#include "bag_topics.h"
#include "planar_vslam/geometry/expected.h"
#include "skip_log.h"
#include "tf_tree.h"

namespace planar_vslam::io {

// Frames to connect with the base; an empty name: not needed.
struct SensorFrames {
  std::string base, odom, camera, laser;
  std::string odometry_child;  // the frame whose pose the odometry topic gives
};

struct BagTransforms {
  TfTree tree;
  bool has_base_transform = false;        // false: no tf at all, base is the camera
  TfChain base_to_camera, base_to_laser;  // of has_base_transform
  TfChain odometry_child_to_base;         // with an odometry topic
  std::optional<TfChain> odom_to_base;    // without an odometry topic, where tf holds a moving odom -> base
  std::vector<std::string> notes;         // what the user should know
};

// `frames->base` empty: tf is not used. Frames that tf knows with a prefix only (`robot1/base_footprint`) are called so
// afterwards. Errors name the missing frame and those there are.
Expected<BagTransforms> ReadTransforms(const Bags& bags, const std::string& file, const BagTopics& topics,
                                       SensorFrames* frames, SkipLog* skipped);

}  // namespace planar_vslam::io
