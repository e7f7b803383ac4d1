#pragma once
// What a robot sends that drives along a wall, as messages for the tracking loop.
#include <algorithm>
#include <boost/make_shared.hpp>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "converters.h"
#include "parameters.h"
#include "support/wall_drive.h"
#include "tracking_loop.h"

namespace planar_vslam::ros_face {

using test::WallDrive;

inline const WallDrive& Wall() {
  static const WallDrive wall(120);
  return wall;
}
inline std::string BaseFrame() { return NodeSettings().pipeline.topics.base_frame; }
inline ros::Time StampOf(int image) { return ToRosTime(WallDrive::StampOf(image)); }

inline Input CameraInfo() {
  const auto info = boost::make_shared<sensor_msgs::CameraInfo>();
  info->width = WallDrive::kWidth;
  info->height = WallDrive::kHeight;
  info->distortion_model = "plumb_bob";
  info->D.assign(5, 0.0);
  info->K = {WallDrive::kFocalLength,
             0.0,
             WallDrive::kWidth / 2.0,
             0.0,
             WallDrive::kFocalLength,
             WallDrive::kHeight / 2.0,
             0.0,
             0.0,
             1.0};
  info->P = {WallDrive::kFocalLength,
             0.0,
             WallDrive::kWidth / 2.0,
             0.0,
             0.0,
             WallDrive::kFocalLength,
             WallDrive::kHeight / 2.0,
             0.0,
             0.0,
             0.0,
             1.0,
             0.0};
  return sensor_msgs::CameraInfoConstPtr(info);
}

// Where the camera is on the base.
inline Input CameraTransform() {
  const auto message = boost::make_shared<tf2_msgs::TFMessage>();
  std_msgs::Header header;
  header.frame_id = BaseFrame();
  message->transforms.push_back(ToTransform(header, "camera", WallDrive::CameraMount()));
  return TfInput{message, true};
}

// `view`: rows of WallDrive::kWidth pixels.
inline Input Image(const ros::Time& stamp, std::vector<std::uint8_t> view) {
  const auto image = boost::make_shared<sensor_msgs::Image>();
  image->header.stamp = stamp;
  image->header.frame_id = "camera";
  image->width = WallDrive::kWidth;
  image->height = static_cast<std::uint32_t>(view.size()) / image->width;
  image->step = image->width;
  image->encoding = "mono8";
  image->data = std::move(view);
  return sensor_msgs::ImageConstPtr(image);
}
inline Input ImageAt(int number) { return Image(StampOf(number), Wall().View(number)); }

// Faultless wheels at the place of image `position`.
inline Input Odometry(const ros::Time& stamp, int position) {
  const auto odometry = boost::make_shared<nav_msgs::Odometry>();
  odometry->header.stamp = stamp;
  odometry->child_frame_id = BaseFrame();
  odometry->pose.pose = ToPose(Embed3(WallDrive::PoseOf(position)));
  return nav_msgs::OdometryConstPtr(odometry);
}
inline Input OdometryAt(int number) { return Odometry(StampOf(number), number); }

inline NodeSettings Settings(OdometrySource odometry = OdometrySource::kTopic) {
  NodeSettings settings;
  settings.odometry = odometry;
  settings.lossless = true;  // jobs run inline: a drive always goes the same way
  return settings;
}

// A loop, and what it told.
class Robot {
 public:
  explicit Robot(const NodeSettings& settings = Settings())
      : loop(settings, "image",
             {[this](const FrameReport& report) { reports.push_back(report); }, [this] { ++restarts; },
              [this](const std::string& reason) { refusals.push_back(reason); }}) {}

  void Handle(const Input& input) { loop.Handle(input); }
  void Begin() {
    Handle(CameraInfo());
    Handle(CameraTransform());
  }
  void Drive(int from, int to) {
    for (int i = from; i < to; ++i) {
      Handle(OdometryAt(i));
      Handle(ImageAt(i));
    }
  }
  // How often input was not used for a reason that begins so.
  long Unused(const std::string& reason) const {
    long sum = 0;
    for (const auto& [name, count] : loop.unused()) sum += name.rfind(reason, 0) == 0 ? count : 0;
    return sum;
  }
  bool Tracks() const {
    return !reports.empty() && reports.back().state == TrackingState::kTracking && reports.back().metric &&
           loop.map() != nullptr;
  }

  std::vector<FrameReport> reports;
  int restarts = 0;
  std::vector<std::string> refusals;
  TrackingLoop loop;
};

}  // namespace planar_vslam::ros_face
