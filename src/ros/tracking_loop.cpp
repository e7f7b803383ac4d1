#include "tracking_loop.h"

#include <fmt/format.h>
#include <ros/console.h>

#include <utility>

#include "converters.h"
#include "planar_vslam/io/message_values.h"

namespace planar_vslam::ros_face {
namespace {

// How long an input waits for tf, camera_info or odometry, in time of its own stream. A robot's messages arrive up to a
// few hundred milliseconds after their stamp.
constexpr double kPatienceSeconds = 2.0;
// tf is asked about inputs that wait, never about older ones.
constexpr double kTfCacheSeconds = 30.0;

}  // namespace

TrackingLoop::TrackingLoop(const NodeSettings& settings, const std::string& image_topic, TrackingEvents events)
    : settings_(settings),
      image_topic_(image_topic),
      events_(std::move(events)),
      base_frame_(io::FrameName(settings.pipeline.topics.base_frame)),
      odom_frame_(io::FrameName(settings.pipeline.topics.odom_frame)),
      tf_(ros::Duration(kTfCacheSeconds)) {}

void TrackingLoop::Handle(const Input& input) {
  std::visit([this](const auto& message) { On(message); }, input);
  Drain();
}

void TrackingLoop::ForgetInput() {
  images_.clear();
  odometry_.clear();
  scans_.clear();
  newest_ = {};
  odometry_messages_ = io::OdometryMessages();
  odometry_survey_ = {};
  waiting_for_.clear();
}

void TrackingLoop::Restart() {
  ForgetInput();
  if (estimator_ != nullptr) estimator_->Restart();
  events_.on_restart();
}

std::optional<EstimatorSnapshot> TrackingLoop::Snapshot() const {
  if (estimator_ == nullptr) return std::nullopt;
  return estimator_->Snapshot();
}

std::string TrackingLoop::waiting_for() const {
  if (!waiting_for_.empty()) return waiting_for_;
  return estimator_ != nullptr && estimator_->images_waiting() > 0 ? "odometry" : "";
}

std::map<std::string, long> TrackingLoop::unused() const {
  std::map<std::string, long> all = unused_;
  if (estimator_ == nullptr) return all;
  for (const auto& [reason, count] : estimator_->unused_input()) all[reason] += count;
  return all;
}

bool TrackingLoop::AcceptStamp(Stream stream, const ros::Time& stamp) {
  static constexpr const char* kNames[] = {"image", "odometry", "scan"};
  const std::size_t index = static_cast<std::size_t>(stream);
  if (stamp.isZero()) {
    ++unused_[fmt::format("{} stamp zero", kNames[index])];
    return false;
  }
  if (newest_[index].has_value() && SecondsBetween(ToTimestamp(stamp), *newest_[index]) > kTimeJumpSeconds) {
    ROS_WARN("%s stamps jumped back by %.1f s: starting over", kNames[index],
             SecondsBetween(ToTimestamp(stamp), *newest_[index]));
    tf_.clear();
    Restart();
  }
  if (newest_[index].has_value() && ToTimestamp(stamp) <= *newest_[index]) {
    ++unused_[fmt::format("{} stamp not increasing", kNames[index])];
    return false;
  }
  newest_[index] = ToTimestamp(stamp);
  return true;
}

template <class Message>
void TrackingLoop::AddImage(const Message& image) {
  if (paused_ || !AcceptStamp(Stream::kImage, image->header.stamp)) return;
  images_.push_back({ToTimestamp(image->header.stamp), io::FrameName(image->header.frame_id),
                     [image, depth = &depth_] { return io::ToGrayImage(*image, depth); }});
}

void TrackingLoop::On(const sensor_msgs::ImageConstPtr& image) { AddImage(image); }
void TrackingLoop::On(const sensor_msgs::CompressedImageConstPtr& image) { AddImage(image); }

void TrackingLoop::On(const sensor_msgs::CameraInfoConstPtr& info) {
  const bool rectified = io::IsRectifiedImage(image_topic_, settings_.pipeline.topics.rectified);
  if (camera_.has_value() || !io::IsFilledIn(*info, rectified)) return;
  const Expected<CameraModel> camera = io::ToCameraModel(*info, "camera_info of " + image_topic_, rectified);
  if (camera.ok()) {
    camera_ = *camera;
  } else {
    ROS_ERROR_THROTTLE(10.0, "%s", camera.error().message.c_str());
    ++unused_["camera_info not usable"];
  }
}

void TrackingLoop::On(const nav_msgs::OdometryConstPtr& odometry) {
  if (settings_.odometry != OdometrySource::kTopic || !AcceptStamp(Stream::kOdometry, odometry->header.stamp)) return;
  odometry_.push_back({ToTimestamp(odometry->header.stamp), odometry});
}

void TrackingLoop::On(const sensor_msgs::LaserScanConstPtr& scan) {
  if (!settings_.with_odometry() || !AcceptStamp(Stream::kScan, scan->header.stamp)) return;
  scans_.push_back({ToTimestamp(scan->header.stamp), scan});
}

void TrackingLoop::On(const TfInput& tf) {
  for (geometry_msgs::TransformStamped transform : tf.message->transforms) {
    transform.header.frame_id = io::FrameName(transform.header.frame_id);
    transform.child_frame_id = io::FrameName(transform.child_frame_id);
    if (transform.header.frame_id == settings_.map_frame) continue;  // our own
    const bool is_odometry =
        settings_.odometry == OdometrySource::kTf && !tf.is_static && transform.header.frame_id == odom_frame_;
    const bool is_new = is_odometry && AcceptStamp(Stream::kOdometry, transform.header.stamp);  // which may clear tf_
    tf_.setTransform(transform, "tf", tf.is_static);
    if (is_new) odometry_.push_back({ToTimestamp(transform.header.stamp), nullptr});
  }
}

std::optional<Rigid3> TrackingLoop::LookUp(const std::string& parent, const std::string& child, Timestamp stamp) const {
  if (parent == child) return Rigid3();
  const ros::Time time = ToRosTime(stamp);
  if (!tf_.canTransform(parent, child, time)) return std::nullopt;
  return io::ToRigid3(tf_.lookupTransform(parent, child, time).transform);
}

// Nothing moves without an image that needs it, so that a silent camera makes nothing pile up. Scans go before the
// odometry that completes the image, and their packet with it.
void TrackingLoop::Drain() {
  UseInOrder(&images_, "image");
  UseInOrder(&scans_, "scan");
  UseInOrder(&odometry_, "odometry");
}

bool TrackingLoop::ImageWaits() const {
  return estimator_ != nullptr && (!images_.empty() || estimator_->images_waiting() > 0);
}

template <class Waiting>
void TrackingLoop::UseInOrder(std::deque<Waiting>* waiting, const char* what) {
  while (!waiting->empty() && Use(waiting->front())) waiting->pop_front();
  while (!waiting->empty() && SecondsBetween(waiting->front().stamp, waiting->back().stamp) > kPatienceSeconds) {
    waiting->pop_front();
    ++unused_[fmt::format("{} waited over {} s", what, kPatienceSeconds)];
  }
}

bool TrackingLoop::Use(const WaitingOdometry& odometry) {
  if (!ImageWaits()) return false;
  if (odometry.message == nullptr) {
    const std::optional<Rigid3> T_odom_base = LookUp(odom_frame_, base_frame_, odometry.stamp);
    if (!T_odom_base.has_value()) return false;
    Report(estimator_->Add(OdometryReading{odometry.stamp, ProjectToPlane(*T_odom_base)}));
    return true;
  }
  const std::string child = io::FrameName(odometry.message->child_frame_id);
  const auto T_child_base = LookUp(child.empty() ? base_frame_ : child, base_frame_, odometry.stamp);
  if (!T_child_base.has_value()) return false;
  odometry_survey_.Add(*odometry.message);
  if (odometry_survey_.pose_stands()) {
    ROS_WARN_THROTTLE(10.0, "odometry: the pose never changes although the twist drives; expected poses");
    ++unused_["odometry whose pose stands while its twist drives"];
  }
  const Expected<OdometryReading> reading = odometry_messages_.Read(*odometry.message, *T_child_base);
  if (!reading.ok()) {
    ROS_WARN_THROTTLE(10.0, "%s", reading.error().message.c_str());
    ++unused_[reading.error().message];
    return true;
  }
  if (odometry_messages_.placeholder_covariance()) ++unused_["odometry covariance that is a placeholder"];
  Report(estimator_->Add(*reading));
  return true;
}

bool TrackingLoop::Use(const WaitingScan& scan) {
  if (!ImageWaits()) return false;
  const auto T_base_laser = LookUp(base_frame_, io::FrameName(scan.message->header.frame_id), scan.stamp);
  if (!T_base_laser.has_value()) return false;
  Expected<PlanarScan> checked = io::ToPlanarScan(*scan.message);
  if (!checked.ok()) {
    ROS_WARN_THROTTLE(10.0, "%s", checked.error().message.c_str());
    ++unused_[checked.error().message];
    return true;
  }
  Report(estimator_->Add(LaserFrame{std::move(*checked), *T_base_laser}));
  return true;
}

bool TrackingLoop::Use(const WaitingImage& image) {
  if (estimator_ == nullptr) {
    if (!camera_.has_value()) {
      waiting_for_ = "camera_info";
      return false;
    }
    StartEstimator();
  }
  waiting_for_.clear();
  if (refused_) return true;
  std::optional<Rigid3> T_base_camera = Rigid3();
  if (settings_.has_base()) T_base_camera = LookUp(base_frame_, image.frame_id, image.stamp);
  if (!T_base_camera.has_value()) {
    waiting_for_ = fmt::format("tf {} -> {}", base_frame_, image.frame_id);
    return false;
  }
  image_frame_ = image.frame_id;
  Expected<GrayImage> gray = image.decode();
  if (!gray.ok()) {
    ROS_WARN_THROTTLE(10.0, "%s: %s", image_topic_.c_str(), gray.error().message.c_str());
    ++unused_["image not decodable"];
  } else if (gray->width != camera_->width || gray->height != camera_->height) {
    ROS_WARN_THROTTLE(10.0, "%s: image of %dx%d px; expected %dx%d as camera_info says", image_topic_.c_str(),
                      gray->width, gray->height, camera_->width, camera_->height);
    ++unused_["image of another size than camera_info says"];
  } else {
    Report(estimator_->Add(CameraFrame{ImageFrame{image.stamp, std::move(*gray)}, *T_base_camera}));
  }
  return true;
}

void TrackingLoop::StartEstimator() {
  // A recording played losslessly has no hurry: the inline schedule gives the command line's poses.
  const Schedule schedule = settings_.lossless ? Schedule::kInline : Schedule::kThreaded;
  estimator_ = std::make_unique<Estimator>(EstimatorSettings{settings_.pipeline, *camera_, settings_.has_base(),
                                                             settings_.with_odometry(), schedule,
                                                             static_cast<std::size_t>(settings_.path_frames)});
  if (settings_.saved_map == nullptr) {
    if (estimator_->settings().options.initializer.mode != settings_.pipeline.initializer.mode) {
      ROS_WARN("no odometry: initialising visually, scale stays unknown");
    }
    return;
  }
  const Expected<bool> loaded = estimator_->LoadMap(*settings_.saved_map);
  refused_ = !loaded.ok();
  if (refused_) events_.on_map_refused(loaded.error().message);
}

void TrackingLoop::Report(const std::vector<FrameReport>& frames) {
  for (const FrameReport& frame : frames) events_.on_frame(frame);
}

}  // namespace planar_vslam::ros_face
