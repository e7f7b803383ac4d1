#include "bag_survey.h"

#include <fmt/format.h>

#include "bag_messages.h"
#include "planar_vslam/sensor/scan_check.h"

namespace planar_vslam::io {
namespace {

// The images at both ends of the bag: how they look, which frame they are of, when they were taken.
struct ImageSpan {
  std::string frame_id;
  int width = 0, height = 0;
  Timestamp first, last;
  long count = 0;
};

// The first image that can be decoded, and the stamps of the first and the last one.
Expected<ImageSpan> FindImages(const std::string& file, const BagTopics& topics, const StreamIndex& images) {
  if (images.size() == 0) {
    return Error{fmt::format("{}: no usable image on {}: no message with a stamp", file, topics.image)};
  }
  ImageSpan span;
  span.count = static_cast<long>(images.size());
  span.last = images.stamp(images.size() - 1);
  std::string why;
  for (std::size_t i = 0; i < images.size(); ++i) {
    try {
      GreyDepth depth;
      const StampedImage stored = ReadImage(images.message(i), topics.image_compressed, &depth);
      if (stored.image) {
        span.frame_id = FrameName(stored.frame_id);
        span.width = stored.image->width;
        span.height = stored.image->height;
        span.first = images.stamp(i);
        return span;
      }
      why = stored.image.error().message;
    } catch (const DamagedMessage& damaged) {
      why = damaged.what();
    }
  }
  return Error{fmt::format("{}: no usable image on {}: {}", file, topics.image, why)};
}

// The first camera_info that is filled in; drivers send zeros until they have read their calibration.
Expected<CameraModel> ReadCamera(const Bags& bags, const std::string& file, const BagTopics& topics,
                                 RectifiedImages rectified) {
  const std::string where = file + ": " + topics.camera_info;
  const bool is_rectified = IsRectifiedImage(topics.image, rectified);
  std::optional<Expected<CameraModel>> camera;
  bool any_whole = false;
  ForEachMessage(bags, {topics.camera_info}, [&](const StoredMessage& message) {
    const auto info = message.ReadIfWhole<sensor_msgs::CameraInfo>();
    any_whole = any_whole || info != nullptr;
    if (info != nullptr && IsFilledIn(*info, is_rectified)) camera = ToCameraModel(*info, where, is_rectified);
    return !camera.has_value();
  });
  if (camera.has_value()) return *camera;
  if (!any_whole) return Error{where + ": no message is whole; expected the intrinsics of a calibrated camera"};
  return Error{fmt::format("{}: {} is zero in every message; expected the intrinsics of a calibrated camera", where,
                           is_rectified ? "P" : "K")};
}

SensorFrames FramesOf(const BagIndex& index, const BagTopics& topics, const ImageSpan& images,
                      const BagOptions& options) {
  SensorFrames frames;
  frames.base = FrameName(options.base_frame);
  frames.camera = images.frame_id;
  if (index.scans.size() > 0) frames.laser = FrameName(index.scans.message(0).ReadHeader().frame_id);
  if (topics.odometry.empty()) {
    frames.odom = FrameName(options.odom_frame);
  } else if (index.odometry.size() > 0) {
    const auto odometry = index.odometry.message(0).Read<nav_msgs::Odometry>();
    frames.odometry_child = OdometryChild(*odometry, frames.base);
  }
  return frames;
}

// Which topics are read, in words.
std::string DescribeTopics(const BagSurvey& survey) {
  const BagTopics& topics = survey.topics;
  std::vector<std::string> parts = {"images " + topics.image, "camera_info " + topics.camera_info};
  if (!topics.odometry.empty()) parts.push_back("odometry " + topics.odometry);
  if (survey.transforms.odom_to_base.has_value()) parts.emplace_back("odometry by tf");
  if (!topics.scan.empty()) parts.push_back("scans " + topics.scan);
  return fmt::format("{}", fmt::join(parts, ", "));
}

// The frames from `from` on, in the order of the way.
std::string DescribeChain(const TfTree& tree, const std::string& from, const std::string& to, const TfChain& chain) {
  std::vector<std::string> frames;
  for (const std::string& frame : chain.up) frames.push_back(frame);
  if (frames.empty() || frames.front() != from) frames.insert(frames.begin(), from);
  for (const std::string& frame : chain.down) {
    if (frame != frames.back()) frames.push_back(frame);
  }
  if (frames.back() != to) frames.push_back(to);
  return fmt::format("{}{}", fmt::join(frames, " > "), tree.StampsOfMotion(chain).empty() ? "" : " (moves)");
}

std::string DescribeFrames(const BagTransforms& transforms, const SensorFrames& frames) {
  if (!transforms.has_base_transform) return "";
  const TfTree& tree = transforms.tree;
  std::vector<std::string> ways = {DescribeChain(tree, frames.base, frames.camera, transforms.base_to_camera)};
  if (!frames.laser.empty()) ways.push_back(DescribeChain(tree, frames.base, frames.laser, transforms.base_to_laser));
  if (!frames.odometry_child.empty() && frames.odometry_child != frames.base) {
    ways.push_back(DescribeChain(tree, frames.odometry_child, frames.base, transforms.odometry_child_to_base));
  }
  if (transforms.odom_to_base.has_value()) {
    ways.push_back(DescribeChain(tree, frames.odom, frames.base, *transforms.odom_to_base));
  }
  return fmt::format("{}", fmt::join(ways, ", "));
}

// A topic whose poses cannot be used is as good as none, and tf may hold what it should.
void ChooseOdometry(BagSurvey* survey, SkipLog* skipped) {
  const OdometrySurvey& odometry = survey->index.odometry_survey;
  if (!survey->topics.odometry.empty() && survey->index.odometry.size() == 0) {
    survey->info.notes.push_back(
        fmt::format("{}: no message with a stamp: odometry is taken from tf, if there", survey->topics.odometry));
    survey->topics.odometry.clear();
  } else if (odometry.pose_stands()) {
    survey->odometry_by_twist = true;
    survey->info.notes.push_back(fmt::format(
        "{}: the pose never changes although the twist drives: the twist is integrated", survey->topics.odometry));
  } else if (!odometry.refused().empty() && !odometry.poses_usable()) {
    for (const auto& [reason, count] : odometry.refused()) {
      for (long left = count; left > 0; --left) skipped->Count(reason, survey->topics.odometry);
    }
    survey->info.notes.push_back(fmt::format("{}: {}: odometry is taken from tf, if there", survey->topics.odometry,
                                             odometry.DescribeRefused()));
    survey->topics.odometry.clear();
    survey->index.odometry = {};
  }
}

std::string WhyNoOdometry(const BagTopics& topics, const BagOptions& options) {
  const std::string alike = topics.like_odometry.empty()
                                ? std::string(";")
                                : fmt::format(": {} cannot be read as such;", fmt::join(topics.like_odometry, ", "));
  return fmt::format("no odometry{} expected a nav_msgs/Odometry topic, or tf '{}' -> '{}'", alike, options.odom_frame,
                     options.base_frame);
}

// What a laser leaves out that it should say.
void NoteScans(BagSurvey* survey) {
  if (survey->index.scans.size() == 0) return;
  const auto scan = survey->index.scans.message(0).ReadIfWhole<sensor_msgs::LaserScan>();
  if (scan == nullptr) return;
  const Expected<PlanarScan> checked = ToPlanarScan(*scan);
  PlanarScan as_it_came;
  as_it_came.range_min = static_cast<double>(scan->range_min);
  as_it_came.range_max = static_cast<double>(scan->range_max);
  if (!checked.ok()) return;
  if (StatesRange(as_it_came)) {
    if (as_it_came.range_min < as_it_came.range_max) return;
    survey->info.notes.push_back(
        fmt::format("{}: range_min is {}, beyond range_max: taken for 0", survey->topics.scan, scan->range_min));
    return;
  }
  survey->info.notes.push_back(
      fmt::format("{}: range_max is {}: taken for unlimited, and beams without return say nothing", survey->topics.scan,
                  scan->range_max));
}

}  // namespace

std::string OdometryChild(const nav_msgs::Odometry& odometry, const std::string& base) {
  return odometry.child_frame_id.empty() ? base : FrameName(odometry.child_frame_id);
}

Expected<BagSurvey> SurveyBag(const Bags& bags, const std::string& file, const RecordingOptions& options,
                              SkipLog* skipped) {
  if (options.odometry_file.has_value()) {
    return Error{fmt::format("{}: an odometry file was given; expected one only with a dataset folder", file)};
  }
  BagSurvey survey;
  Expected<BagTopics> topics = ChooseTopics(bags, file, options.bag);
  if (!topics) return topics.error();
  survey.topics = std::move(*topics);
  const Expected<CameraModel> camera = ReadCamera(bags, file, survey.topics, options.bag.rectified);
  if (!camera) return camera.error();
  survey.index = ReadIndex(bags, survey.topics, skipped);
  const Expected<ImageSpan> images = FindImages(file, survey.topics, survey.index.images);
  if (!images) return images.error();
  if (images->width != camera->width || images->height != camera->height) {
    return Error{fmt::format("{}: images on {} are {}x{} px; expected {}x{} as {} says", file, survey.topics.image,
                             images->width, images->height, camera->width, camera->height, survey.topics.camera_info)};
  }
  survey.info.notes = bags.notes;
  survey.info.notes.insert(survey.info.notes.end(), survey.index.notes.begin(), survey.index.notes.end());
  ChooseOdometry(&survey, skipped);
  NoteScans(&survey);
  if (survey.index.scans.size() > 0 && survey.index.scans.message(0).ReadHeader().frame_id.empty()) {
    return Error{
        fmt::format("{}: header.frame_id on {} is empty; expected the laser's tf frame", file, survey.topics.scan)};
  }
  survey.said = FramesOf(survey.index, survey.topics, *images, options.bag);
  SensorFrames frames = survey.said;
  Expected<BagTransforms> transforms = ReadTransforms(bags, file, survey.topics, &frames, skipped);
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
  info.topics = DescribeTopics(survey);
  info.frames = DescribeFrames(survey.transforms, frames);
  info.notes.insert(info.notes.end(), survey.transforms.notes.begin(), survey.transforms.notes.end());
  if (!info.has_odometry) {
    const std::string why = WhyNoOdometry(survey.topics, options.bag);
    if (options.require_odometry) return Error{fmt::format("{}: {}", file, why)};
    if (!survey.topics.like_odometry.empty()) info.notes.push_back(why);
  }
  return survey;
}

}  // namespace planar_vslam::io
