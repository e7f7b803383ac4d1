#pragma once
// What is read from a bag before its events are streamed: topics, frames, transforms, intrinsics, the first image.
#include <rosbag/bag.h>

#include <filesystem>
#include <memory>
#include <string>

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
  BagTransforms transforms;
  RecordingInfo info;
};

// Both throw what rosbag throws on broken files.
Expected<std::unique_ptr<rosbag::Bag>> OpenBag(const std::filesystem::path& path);
Expected<BagSurvey> SurveyBag(const rosbag::Bag& bag, const std::string& file, const RecordingOptions& options,
                              SkipLog* skipped);

}  // namespace planar_vslam::io
