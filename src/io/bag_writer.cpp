#include "planar_vslam/io/bag_writer.h"

#include <fmt/format.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/LaserScan.h>
#include <tf2_msgs/TFMessage.h>

#include <string>

#include "bag_cdr.h"
#include "bag_sink.h"
#include "bag_topics.h"
#include "planar_vslam/io/value_messages.h"
#include "planar_vslam/sensor/jpeg.h"

namespace planar_vslam {
namespace {

constexpr std::int64_t kEpoch = 1'700'000'000;  // s, where second 0 lies
constexpr int kJpegQuality = 95;
constexpr char kBase[] = "base_footprint", kOdom[] = "odom", kCamera[] = "camera_optical_frame",
               kLaser[] = "laser_frame";

ros::Time ToRos(Timestamp stamp) {
  return ros::Time().fromNSec(static_cast<std::uint64_t>(kEpoch * 1'000'000'000 + stamp.nanoseconds));
}

geometry_msgs::TransformStamped Transform(const ros::Time& stamp, const std::string& parent, const std::string& child,
                                          const Rigid3& T_parent_child) {
  geometry_msgs::TransformStamped message;
  message.header.stamp = stamp;
  message.header.frame_id = parent;
  message.child_frame_id = child;
  const Eigen::Vector3d& t = T_parent_child.translation;
  const Eigen::Quaterniond& q = T_parent_child.rotation;
  message.transform.translation.x = t.x(), message.transform.translation.y = t.y();
  message.transform.translation.z = t.z();
  message.transform.rotation.x = q.x(), message.transform.rotation.y = q.y();
  message.transform.rotation.z = q.z(), message.transform.rotation.w = q.w();
  return message;
}

// Latched where who comes late while the bag is played has to hear it; else nothing, which is rosbag's own.
template <class Message>
boost::shared_ptr<ros::M_string> HeaderOf(const std::string& topic) {
  if (!io::IsStaticTf(topic)) return nullptr;
  namespace traits = ros::message_traits;
  return boost::make_shared<ros::M_string>(ros::M_string{{"type", traits::datatype<Message>()},
                                                         {"md5sum", traits::md5sum<Message>()},
                                                         {"message_definition", traits::definition<Message>()},
                                                         {"latching", "1"}});
}

}  // namespace

struct BagWriter::Impl {
  std::string path;
  BagRobot robot;
  rosbag::Bag bag;
  std::unique_ptr<io::MessageSink> sink;  // instead of the bag: a ROS 2 recording
  std::uint32_t images = 0;
  std::optional<OdometryReading> last_reading;
  std::optional<Error> error;

  template <class Message>
  void Write(const char* topic, const ros::Time& time, const Message& message) {
    if (error.has_value()) return;
    try {
      if (sink == nullptr) {
        bag.write(topic, time, message, HeaderOf<Message>(topic));
        return;
      }
      io::CdrWriter writer;
      writer(message);
      sink->Write(topic, ros::message_traits::datatype<Message>(), static_cast<std::int64_t>(time.toNSec()),
                  writer.bytes());
    } catch (const std::runtime_error& exception) {
      error = Error{fmt::format("{}: cannot be written: {}", path, exception.what())};
    }
  }
  void WriteTransform(const char* topic, const geometry_msgs::TransformStamped& transform) {
    tf2_msgs::TFMessage message;
    message.transforms.push_back(transform);
    Write(topic, transform.header.stamp, message);
  }
};

BagWriter::BagWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
BagWriter::BagWriter(BagWriter&&) noexcept = default;
BagWriter& BagWriter::operator=(BagWriter&&) noexcept = default;
BagWriter::~BagWriter() = default;

Expected<BagWriter> BagWriter::Create(const std::filesystem::path& path, const BagRobot& robot) {
  auto impl = std::make_unique<Impl>();
  impl->path = path.string();
  impl->robot = robot;
  try {
    impl->sink = io::CreateSink(path);
    if (impl->sink == nullptr) impl->bag.open(path.string(), rosbag::bagmode::Write);
  } catch (const std::runtime_error& exception) {
    return Error{fmt::format("{}: cannot be written: {}", path.string(), exception.what())};
  }
  const ros::Time start = ToRos({});
  tf2_msgs::TFMessage fixed;
  if (!robot.camera_moves) fixed.transforms.push_back(Transform(start, kBase, kCamera, robot.T_base_camera));
  fixed.transforms.push_back(Transform(start, kBase, kLaser, robot.T_base_laser));
  impl->Write("/tf_static", start, fixed);
  return BagWriter(std::move(impl));
}

void BagWriter::Write(const CameraFrame& frame) {
  const ros::Time stamp = ToRos(frame.image.stamp);
  if (impl_->robot.camera_moves) impl_->WriteTransform("/tf", Transform(stamp, kBase, kCamera, frame.T_base_camera));
  const GrayImage& image = frame.image.image;
  if (image.empty()) return;
  sensor_msgs::CompressedImage message;
  message.header.seq = impl_->images++;
  message.header.stamp = stamp;
  message.header.frame_id = kCamera;
  message.format = "jpeg";
  std::optional<std::vector<std::uint8_t>> bytes = EncodeJpeg(image, kJpegQuality);
  if (!bytes.has_value()) {
    if (!impl_->error.has_value()) {
      impl_->error =
          Error{fmt::format("{}: an image of {}x{} px cannot be JPEG", impl_->path, image.width, image.height)};
    }
    return;
  }
  message.data = std::move(*bytes);
  sensor_msgs::CameraInfo info = io::ToCameraInfo(impl_->robot.camera);
  info.header = message.header;
  impl_->Write("/camera/image_raw/compressed", stamp, message);
  impl_->Write("/camera/camera_info", stamp, info);
}

void BagWriter::Write(const OdometryReading& reading) {
  const ros::Time stamp = ToRos(reading.stamp);
  const geometry_msgs::TransformStamped transform = Transform(stamp, kOdom, kBase, Embed3(reading.T_odom_base));
  nav_msgs::Odometry message = io::ToOdometry(reading, impl_->last_reading);
  message.header = transform.header;
  message.child_frame_id = kBase;
  impl_->last_reading = reading;
  impl_->Write("/odom", stamp, message);
  impl_->WriteTransform("/tf", transform);
}

void BagWriter::Write(const LaserFrame& frame) {
  sensor_msgs::LaserScan message = io::ToLaserScan(frame.scan);
  message.header.stamp = ToRos(frame.scan.stamp);
  message.header.frame_id = kLaser;
  impl_->Write("/scan", message.header.stamp, message);
}

Expected<bool> BagWriter::Close() {
  try {
    if (impl_->sink != nullptr) {
      impl_->sink->Close();
    } else {
      impl_->bag.close();
    }
  } catch (const std::runtime_error& exception) {
    if (!impl_->error.has_value()) {
      impl_->error = Error{fmt::format("{}: cannot be written: {}", impl_->path, exception.what())};
    }
  }
  if (impl_->error.has_value()) return *impl_->error;
  return true;
}

}  // namespace planar_vslam
