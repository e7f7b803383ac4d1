#include "sim_publisher.h"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <nav_msgs/OccupancyGrid.h>
#include <nav_msgs/Odometry.h>
#include <ros/this_node.h>
#include <rosgraph_msgs/Clock.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/LaserScan.h>

#include "converters.h"
#include "planar_vslam/io/value_messages.h"
#include "planar_vslam/sim/solids.h"
#include "planar_vslam/sim/truth_grid.h"

namespace planar_vslam::ros_face {
namespace {

constexpr char kOdom[] = "odom", kBase[] = "base_footprint", kCamera[] = "camera_optical_frame",
               kLaser[] = "laser_frame";
constexpr std::int64_t kFirst = 1'000'000'000;  // ns

std_msgs::Header HeaderAt(Timestamp stamp, const char* frame) {
  std_msgs::Header header;
  header.stamp = SimTime(stamp);
  header.frame_id = frame;
  return header;
}

nav_msgs::OccupancyGrid ToOccupancyGrid(const TruthGrid& truth) {
  constexpr std::int8_t kOccupied = 100, kFree = 0;
  nav_msgs::OccupancyGrid message;
  message.header = HeaderAt({}, kSimWorldFrame);
  message.info.map_load_time = message.header.stamp;
  message.info.resolution = static_cast<float>(truth.resolution);
  message.info.width = static_cast<std::uint32_t>(truth.width);
  message.info.height = static_cast<std::uint32_t>(truth.height);
  message.info.origin.position.x = truth.origin.x();
  message.info.origin.position.y = truth.origin.y();
  message.info.origin.orientation.w = 1.0;
  for (const std::uint8_t occupied : truth.occupied) message.data.push_back(occupied != 0 ? kOccupied : kFree);
  return message;
}

}  // namespace

ros::Time SimTime(Timestamp stamp) { return ToRosTime({stamp.nanoseconds + kFirst}); }

SimPublisher::SimPublisher(ros::NodeHandle* node, const World& world)
    : transport_(*node),
      image_(transport_.advertise("image", 5)),
      camera_info_(node->advertise<sensor_msgs::CameraInfo>("camera_info", 5)),
      scan_(node->advertise<sensor_msgs::LaserScan>("scan", 10)),
      odometry_(node->advertise<nav_msgs::Odometry>("odom", 50)),
      truth_(node->advertise<nav_msgs::Odometry>("ground_truth", 50)),
      truth_map_(node->advertise<nav_msgs::OccupancyGrid>("ground_truth_map", 1, true)),
      clock_(node->advertise<rosgraph_msgs::Clock>("/clock", 10)),
      diagnostics_(node->advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10)),
      camera_(world.camera.model),
      head_moves_(!world.head.motion.empty()) {
  truth_map_.publish(ToOccupancyGrid(MakeTruthGrid(world, kBodyLow, kBodyHigh)));
  PublishFixedTransforms(world);
}

void SimPublisher::PublishFixedTransforms(const World& world) {
  std::vector<geometry_msgs::TransformStamped> fixed = {
      ToTransform(HeaderAt({}, kBase), kLaser, world.laser.T_base_laser())};
  if (!head_moves_) fixed.push_back(ToTransform(HeaderAt({}, kBase), kCamera, world.camera.T_base_camera()));
  static_broadcaster_.sendTransform(fixed);
}

void SimPublisher::PublishClock(double now) {
  rosgraph_msgs::Clock message;
  message.clock = SimTime(Timestamp::FromSeconds(now));
  clock_.publish(message);
}

void SimPublisher::Publish(const SimulatedEvent& event) {
  const Timestamp stamp = StampOf(event);
  if (const auto* reading = std::get_if<OdometryReading>(&event.measurement)) {
    nav_msgs::Odometry message = io::ToOdometry(*reading, last_reading_);
    message.header = HeaderAt(stamp, kOdom);
    message.child_frame_id = kBase;
    last_reading_ = *reading;
    odometry_.publish(message);
    broadcaster_.sendTransform(ToTransform(message.header, kBase, Embed3(reading->T_odom_base)));
    PublishTruth(stamp, event.T_world_base);
  } else if (const auto* sweep = std::get_if<LaserFrame>(&event.measurement)) {
    sensor_msgs::LaserScan message = io::ToLaserScan(sweep->scan);
    message.header = HeaderAt(stamp, kLaser);
    scan_.publish(message);
  } else if (const auto* frame = std::get_if<CameraFrame>(&event.measurement)) {
    if (head_moves_) broadcaster_.sendTransform(ToTransform(HeaderAt(stamp, kBase), kCamera, frame->T_base_camera));
    sensor_msgs::Image image = io::ToImage(frame->image.image);
    sensor_msgs::CameraInfo info = io::ToCameraInfo(camera_);
    image.header = info.header = HeaderAt(stamp, kCamera);
    camera_info_.publish(info);
    image_.publish(image);
  }
}

// The twist is the mean since the truth before it, in the base's axes.
void SimPublisher::PublishTruth(Timestamp stamp, const Rigid3& T_world_base) {
  nav_msgs::Odometry message;
  message.header = HeaderAt(stamp, kSimWorldFrame);
  message.child_frame_id = kBase;
  message.pose.pose = ToPose(T_world_base);
  if (last_truth_.has_value()) {
    const auto& [before, T_before] = *last_truth_;
    const Vector6d twist = LogSe3(T_before.Inverse() * T_world_base) / SecondsBetween(before, stamp);
    message.twist.twist.linear.x = twist[0], message.twist.twist.linear.y = twist[1];
    message.twist.twist.linear.z = twist[2];
    message.twist.twist.angular.x = twist[3], message.twist.twist.angular.y = twist[4];
    message.twist.twist.angular.z = twist[5];
  }
  last_truth_ = {stamp, T_world_base};
  truth_.publish(message);
}

void SimPublisher::PublishDiagnostics(double now, signed char level, const std::string& message,
                                      const std::map<std::string, std::string>& values) {
  diagnostic_msgs::DiagnosticStatus status;
  status.level = level;
  status.name = ros::this_node::getName().substr(1) + ": simulation";
  status.message = message;
  for (const auto& [key, value] : values) {
    diagnostic_msgs::KeyValue pair;
    pair.key = key;
    pair.value = value;
    status.values.push_back(pair);
  }
  diagnostic_msgs::DiagnosticArray array;
  array.header.stamp = SimTime(Timestamp::FromSeconds(now));
  array.status.push_back(status);
  diagnostics_.publish(array);
}

}  // namespace planar_vslam::ros_face
