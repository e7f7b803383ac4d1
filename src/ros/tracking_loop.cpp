#include "tracking_loop.h"

#include <fmt/format.h>
#include <ros/console.h>
#include <ros/init.h>

#include <utility>

#include "converters.h"
#include "planar_vslam/io/message_values.h"

namespace planar_vslam::ros_face {
namespace {

// How long an input waits for tf, camera_info or odometry, in time of its own stream. A robot's messages arrive up to a
// few hundred milliseconds after their stamp.
constexpr double kPatienceSeconds = 2.0;
// Stamps that go back further than messages ever overtake each other: a recording has been started again.
constexpr double kTimeJumpSeconds = 1.0;
// tf is asked about inputs that wait, never about older ones.
constexpr double kTfCacheSeconds = 30.0;

// Without odometry only the images themselves can start a map.
NodeSettings WithUsableInitialization(NodeSettings settings) {
  InitializationMode& mode = settings.pipeline.initializer.mode;
  const bool makes_first_map = settings.saved_map == nullptr;
  if (makes_first_map && !settings.with_odometry() && mode == InitializationMode::kOdometry) {
    mode = InitializationMode::kVisual;
    ROS_WARN("no odometry: initialising visually, scale stays unknown");
  }
  return settings;
}

}  // namespace

TrackingLoop::TrackingLoop(const NodeSettings& settings, const std::string& image_topic, TrackingEvents events)
    : settings_(WithUsableInitialization(settings)),
      image_topic_(image_topic),
      events_(std::move(events)),
      base_frame_(io::FrameName(settings.pipeline.topics.base_frame)),
      odom_frame_(io::FrameName(settings.pipeline.topics.odom_frame)),
      tf_(ros::Duration(kTfCacheSeconds)),
      corrector_(settings.pipeline.calibration),
      synchronizer_(settings.with_odometry()) {}

void TrackingLoop::Handle(const Input& input) {
  std::visit([this](const auto& message) { On(message); }, input);
  Drain();
}

void TrackingLoop::Restart() {
  images_.clear();
  odometry_.clear();
  scans_.clear();
  last_odometry_.reset();
  wheels_ = OdometryBuffer{};
  newest_ = {};
  corrector_ = InputCorrector(settings_.pipeline.calibration);
  synchronizer_ = Synchronizer(settings_.with_odometry());
  if (system_ != nullptr) system_->Reset();
  waiting_for_.clear();
  events_.on_restart();
}

std::optional<MapSnapshot> TrackingLoop::Snapshot() const {
  if (map() == nullptr) return std::nullopt;
  return MapSnapshot{map(), system_->trajectory(), *camera_, last_frame_};
}

std::map<std::string, long> TrackingLoop::unused() const {
  std::map<std::string, long> all = unused_;
  for (const auto& [reason, count] : synchronizer_.dropped()) all[reason] += count;
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
  if (!AcceptStamp(Stream::kImage, image->header.stamp)) return;
  images_.push_back({ToTimestamp(image->header.stamp), io::FrameName(image->header.frame_id),
                     [image] { return io::ToGrayImage(*image); }});
}

void TrackingLoop::On(const sensor_msgs::ImageConstPtr& image) { AddImage(image); }
void TrackingLoop::On(const sensor_msgs::CompressedImageConstPtr& image) { AddImage(image); }

void TrackingLoop::On(const sensor_msgs::CameraInfoConstPtr& info) {
  // Drivers send zeros until they have read their calibration.
  if (camera_.has_value() || (info->K[0] == 0.0 && info->K[4] == 0.0)) return;
  const Expected<CameraModel> camera =
      io::ToCameraModel(*info, "camera_info of " + image_topic_, io::IsRectifiedImage(image_topic_));
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
    const bool is_odometry = settings_.odometry == OdometrySource::kTf && transform.header.frame_id == odom_frame_;
    if (is_odometry && !AcceptStamp(Stream::kOdometry, transform.header.stamp)) continue;
    tf_.setTransform(transform, "tf", tf.is_static);
    if (is_odometry) odometry_.push_back({ToTimestamp(transform.header.stamp), nullptr});
  }
}

std::optional<Rigid3> TrackingLoop::LookUp(const std::string& parent, const std::string& child, Timestamp stamp) const {
  if (parent == child) return Rigid3();
  const ros::Time time = ToRosTime(stamp);
  if (!tf_.canTransform(parent, child, time)) return std::nullopt;
  return io::ToRigid3(tf_.lookupTransform(parent, child, time).transform);
}

// Nothing moves without an image that needs it, so that a silent camera makes nothing pile up.
void TrackingLoop::Drain() {
  UseInOrder(&images_, "image");
  UseInOrder(&odometry_, "odometry");
  UseInOrder(&scans_, "scan");
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
  if (system_ == nullptr || images_.empty()) return false;
  std::optional<Rigid3> T_odom_base;
  OdometryMessageCovariance covariance;
  if (odometry.message == nullptr) {
    T_odom_base = LookUp(odom_frame_, base_frame_, odometry.stamp);
  } else {
    const std::string child = io::FrameName(odometry.message->child_frame_id);
    const auto T_child_base = LookUp(child.empty() ? base_frame_ : child, base_frame_, odometry.stamp);
    if (T_child_base.has_value()) {
      T_odom_base = ToRigid3(odometry.message->pose.pose) * *T_child_base;
      covariance = io::ToOdometryCovariance(*odometry.message, *T_child_base);
    }
  }
  if (!T_odom_base.has_value()) return false;
  OdometryReading read{odometry.stamp, ProjectToPlane(*T_odom_base)};
  read.covariance_rate = covariance_.Rate(read.stamp, read.T_odom_base, covariance);
  const OdometryReading corrected = corrector_.Correct(read);
  synchronizer_.Push(corrected);
  wheels_.Push({corrected.stamp, read.T_odom_base});
  last_odometry_ = corrected.stamp;
  return true;
}

bool TrackingLoop::Use(const WaitingScan& scan) {
  if (system_ == nullptr || images_.empty()) return false;
  const auto T_base_laser = LookUp(base_frame_, io::FrameName(scan.message->header.frame_id), scan.stamp);
  if (!T_base_laser.has_value()) return false;
  synchronizer_.Push(corrector_.Correct(LaserFrame{io::ToPlanarScan(*scan.message), *T_base_laser}));
  return true;
}

bool TrackingLoop::Use(const WaitingImage& image) {
  if (system_ == nullptr) {
    if (!camera_.has_value()) {
      waiting_for_ = "camera_info";
      return false;
    }
    StartSystem();
  }
  std::optional<Rigid3> T_base_camera = Rigid3();
  if (settings_.has_base()) T_base_camera = LookUp(base_frame_, image.frame_id, image.stamp);
  if (!T_base_camera.has_value()) {
    waiting_for_ = fmt::format("tf {} -> {}", base_frame_, image.frame_id);
    return false;
  }
  UseInOrder(&odometry_, "odometry");
  if (settings_.with_odometry() && (!last_odometry_.has_value() || *last_odometry_ < image.stamp)) {
    waiting_for_ = "odometry";
    return false;
  }
  UseInOrder(&scans_, "scan");
  waiting_for_.clear();
  Expected<GrayImage> gray = image.decode();
  if (!gray.ok()) {
    ROS_WARN_THROTTLE(10.0, "%s: %s", image_topic_.c_str(), gray.error().message.c_str());
    ++unused_["image not decodable"];
  } else if (gray->width != camera_->width || gray->height != camera_->height) {
    ROS_WARN_THROTTLE(10.0, "%s: image of %dx%d px; expected %dx%d as camera_info says", image_topic_.c_str(),
                      gray->width, gray->height, camera_->width, camera_->height);
    ++unused_["image of another size than camera_info says"];
  } else {
    synchronizer_.Push(corrector_.Correct(CameraFrame{ImageFrame{image.stamp, std::move(*gray)}, *T_base_camera}));
    Process();
  }
  return true;
}

void TrackingLoop::StartSystem() {
  // A recording played losslessly has no hurry: the inline schedule gives the command line's poses.
  const Schedule schedule = settings_.lossless ? Schedule::kInline : Schedule::kThreaded;
  system_ = std::make_unique<SlamSystem>(settings_.pipeline, *camera_, settings_.has_base(), schedule);
  if (settings_.saved_map == nullptr) return;
  const std::vector<std::string> problems = system_->StartFrom(*settings_.saved_map);
  for (const std::string& problem : problems) ROS_FATAL("map_file: %s", problem.c_str());
  if (!problems.empty()) ros::requestShutdown();
}

void TrackingLoop::Process() {
  while (const std::optional<FramePacket> packet = synchronizer_.Pop()) {
    const FrameReport report = system_->Process(*packet);
    last_frame_ = report.stamp;
    events_.on_frame(report, wheels_.Interpolate(report.stamp));
    wheels_.DropBefore(report.stamp);
  }
}

}  // namespace planar_vslam::ros_face
