#include "bag_survey.h"

#include <console_bridge/console.h>
#include <fmt/format.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/view.h>

#include <algorithm>

#include "bag_check.h"
#include "bag_messages.h"

namespace planar_vslam::io {
namespace {

// The images at both ends of the bag: how they look, which frame they are of, when they were taken.
struct ImageSpan {
  std::string frame_id;
  int width = 0, height = 0;
  Timestamp first, last;
  long count = 0;
};

template <class M>
boost::shared_ptr<M> FirstMessage(const rosbag::Bag& bag, const std::string& topic) {
  rosbag::View view(bag, rosbag::TopicQuery(topic));
  for (const rosbag::MessageInstance& message : view) return Instantiate<M>(message);
  return nullptr;
}

// The first image that can be decoded and has a stamp; the last stamp of the bag's last image.
Expected<ImageSpan> FindImages(const rosbag::Bag& bag, const std::string& file, const BagTopics& topics) {
  rosbag::View view(bag, rosbag::TopicQuery(topics.image));
  ImageSpan span;
  span.count = static_cast<long>(view.size());
  std::string why = "the topic is empty";
  for (const rosbag::MessageInstance& message : view) {
    const StampedImage stored = ReadImage(message, topics.image_compressed);
    if (stored.image && !stored.stamp.isZero()) {
      span.frame_id = FrameName(stored.frame_id);
      span.width = stored.image->width;
      span.height = stored.image->height;
      span.first = span.last = ToTimestamp(stored.stamp);
      break;
    }
    why = stored.image ? "header.stamp is zero" : stored.image.error().message;
  }
  if (span.width == 0) return Error{fmt::format("{}: no usable image on {}: {}", file, topics.image, why)};
  rosbag::View end(bag, rosbag::TopicQuery(topics.image), view.getEndTime());
  for (const rosbag::MessageInstance& message : end) {
    span.last = std::max(span.last, ToTimestamp(ReadImage(message, topics.image_compressed).stamp));
  }
  return span;
}

// The first camera_info that is filled in; drivers send zeros until they have read their calibration.
Expected<CameraModel> ReadCamera(const rosbag::Bag& bag, const std::string& file, const BagTopics& topics) {
  const std::string where = file + ": " + topics.camera_info;
  rosbag::View view(bag, rosbag::TopicQuery(topics.camera_info));
  for (const rosbag::MessageInstance& message : view) {
    const auto info = Instantiate<sensor_msgs::CameraInfo>(message);
    if (info->K[0] == 0.0 && info->K[4] == 0.0) continue;
    return ToCameraModel(*info, where, IsRectifiedImage(topics.image));
  }
  return Error{fmt::format("{}: K is zero in every message; expected the intrinsics of a calibrated camera", where)};
}

SensorFrames FramesOf(const rosbag::Bag& bag, const BagTopics& topics, const ImageSpan& images,
                      const BagOptions& options) {
  SensorFrames frames;
  frames.base = FrameName(options.base_frame);
  frames.camera = images.frame_id;
  if (!topics.scan.empty()) {
    if (const auto scan = FirstMessage<sensor_msgs::LaserScan>(bag, topics.scan)) {
      frames.laser = FrameName(scan->header.frame_id);
    }
  }
  if (topics.odometry.empty()) {
    frames.odom = FrameName(options.odom_frame);
    return frames;
  }
  if (const auto odometry = FirstMessage<nav_msgs::Odometry>(bag, topics.odometry)) {
    frames.odometry_child = odometry->child_frame_id.empty() ? frames.base : FrameName(odometry->child_frame_id);
  }
  return frames;
}

}  // namespace

Expected<std::unique_ptr<rosbag::Bag>> OpenBag(const std::filesystem::path& path) {
  if (const auto damage = CheckBag(path)) return *damage;
  // Its own words on stderr would come beside our one line.
  console_bridge::setLogLevel(console_bridge::CONSOLE_BRIDGE_LOG_NONE);
  auto bag = std::make_unique<rosbag::Bag>();
  bag->open(path.string(), rosbag::bagmode::Read);
  return bag;
}

Expected<BagSurvey> SurveyBag(const rosbag::Bag& bag, const std::string& file, const RecordingOptions& options,
                              SkipLog* skipped) {
  if (options.odometry_file.has_value()) {
    return Error{fmt::format("{}: an odometry file was given; expected one only with a dataset folder", file)};
  }
  BagSurvey survey;
  Expected<BagTopics> topics = ChooseTopics(bag, file, options.bag);
  if (!topics) return topics.error();
  survey.topics = std::move(*topics);
  const Expected<CameraModel> camera = ReadCamera(bag, file, survey.topics);
  if (!camera) return camera.error();
  const Expected<ImageSpan> images = FindImages(bag, file, survey.topics);
  if (!images) return images.error();
  if (images->width != camera->width || images->height != camera->height) {
    return Error{fmt::format("{}: images on {} are {}x{} px; expected {}x{} as {} says", file, survey.topics.image,
                             images->width, images->height, camera->width, camera->height, survey.topics.camera_info)};
  }
  const SensorFrames frames = FramesOf(bag, survey.topics, *images, options.bag);
  Expected<BagTransforms> transforms = ReadTransforms(bag, file, survey.topics, frames, skipped);
  if (!transforms) return transforms.error();
  survey.transforms = std::move(*transforms);
  RecordingInfo& info = survey.info;
  info.camera = *camera;
  info.has_odometry = !frames.odometry_child.empty() || survey.transforms.odom_to_base.has_value();
  info.has_laser = !frames.laser.empty();
  info.has_base_transform = survey.transforms.has_base_transform;
  info.first_image = images->first;
  info.last_image = images->last;
  info.image_count = images->count;
  if (options.require_odometry && !info.has_odometry) {
    return Error{fmt::format("{}: no odometry; expected a nav_msgs/Odometry topic or tf '{}' -> '{}'", file,
                             options.bag.odom_frame, options.bag.base_frame)};
  }
  return survey;
}

}  // namespace planar_vslam::io
