#pragma once
// What is read from a bag before its events are streamed: topics, frames, transforms, intrinsics, the first image.
#include <nav_msgs/Odometry.h>

#include <filesystem>
#include <memory>
#include <string>

#include "bag_files.h"
#include "bag_index.h"
#include "bag_topics.h"
#include "bag_transforms.h"
#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/io/recording.h"
#include "skip_log.h"

namespace planar_vslam::io {

struct BagSurvey {
  BagTopics topics;
  BagIndex index;
  bool odometry_by_twist = false;
  SensorFrames said;  // as the first messages name them, before tf's prefixes
  BagTransforms transforms;
  RecordingInfo info;
};

// The frame whose pose the message gives: the base where it names none.
std::string OdometryChild(const nav_msgs::Odometry& odometry, const std::string& base);

// Throws what rosbag throws on broken files.
Expected<BagSurvey> SurveyBag(const Bags& bags, const std::string& file, const RecordingOptions& options,
                              SkipLog* skipped);

}  // namespace planar_vslam::io
