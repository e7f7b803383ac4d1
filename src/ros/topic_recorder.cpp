// topic_recorder: records the sensor topics of a running system into a rosbag. `planar_vslam doctor --live` runs it and
// examines the bag like any other.
#include <fmt/format.h>
#include <nav_msgs/Odometry.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/LaserScan.h>
#include <tf2_msgs/TFMessage.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <map>
#include <set>

namespace planar_vslam::ros_face {
namespace {

constexpr std::uint64_t kLargestBag = std::uint64_t{2} << 30U;  // bytes: what a robot's /tmp may be expected to take

class TopicRecorder {
 public:
  explicit TopicRecorder(const std::string& path) { bag_.open(path, rosbag::bagmode::Write); }

  // Subscribes to what is new among the topics that somebody publishes.
  void Look() {
    ros::master::V_TopicInfo topics;
    ros::master::getTopics(topics);
    std::set<std::string> names;
    for (const ros::master::TopicInfo& topic : topics) names.insert(topic.name);
    for (const ros::master::TopicInfo& topic : topics) {
      if (subscribers_.count(topic.name) == 0 && !IsOtherForm(topic.name, names)) Follow(topic);
    }
  }
  bool full() const { return bag_.getSize() > kLargestBag; }
  const std::map<std::string, long>& messages() const { return messages_; }
  void Close() {
    subscribers_.clear();
    bag_.close();
  }

 private:
  // Of an image that is there raw: image_transport compresses it for who asks, and nobody needs it twice.
  static bool IsOtherForm(const std::string& name, const std::set<std::string>& names) {
    const std::size_t last = name.rfind('/');
    return last != std::string::npos && name.compare(last, 11, "/compressed") == 0 &&
           names.count(name.substr(0, last)) != 0;
  }

  void Follow(const ros::master::TopicInfo& topic) {
    Try<sensor_msgs::Image>(topic);
    Try<sensor_msgs::CompressedImage>(topic);
    Try<sensor_msgs::CameraInfo>(topic);
    Try<sensor_msgs::LaserScan>(topic);
    Try<nav_msgs::Odometry>(topic);
    Try<tf2_msgs::TFMessage>(topic);
  }
  template <class Message>
  void Try(const ros::master::TopicInfo& topic) {
    if (topic.datatype != ros::message_traits::datatype<Message>()) return;
    constexpr std::uint32_t kQueue = 100;
    const std::string name = topic.name;
    messages_[name] = 0;
    subscribers_[name] = node_.subscribe<Message>(
        name, kQueue, boost::function<void(const ros::MessageEvent<const Message>&)>([this, name](const auto& event) {
          ros::Time now = ros::Time::now();
          if (now < ros::TIME_MIN) now = ros::TIME_MIN;  // a simulation that has not begun
          bag_.write(name, now, *event.getMessage(), event.getConnectionHeaderPtr());
          ++messages_[name];
        }));
  }

  ros::NodeHandle node_;
  rosbag::Bag bag_;
  std::map<std::string, ros::Subscriber> subscribers_;
  std::map<std::string, long> messages_;
};

// The reason it failed for; empty where it did not.
std::string Record(const std::string& path, double seconds) {
  if (!ros::master::check()) {
    return fmt::format("no ROS master at {}; expected a running system (ROS_MASTER_URI)", ros::master::getURI());
  }
  ros::NodeHandle keeps_alive;
  TopicRecorder recorder(path);
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(seconds);
  ros::WallTime look;
  try {
    while (ros::ok() && ros::WallTime::now() < end && !recorder.full()) {
      if (look <= ros::WallTime::now()) {
        recorder.Look();
        look = ros::WallTime::now() + ros::WallDuration(1.0);
      }
      ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.05));
    }
    recorder.Close();
  } catch (const std::exception& exception) {
    fmt::print(stderr, "planar_vslam: {}: cannot be written: {}; expected room for a bag there (TMPDIR)\n", path,
               exception.what());
    std::fflush(stderr);
    std::_Exit(2);  // the bag's destructor would close it, and throw again
  }
  for (const auto& [topic, count] : recorder.messages()) fmt::print(stderr, "heard {}: {} messages\n", topic, count);
  return "";
}

int Main(int argc, char** argv) {
  ros::init(argc, argv, "topic_recorder", ros::init_options::AnonymousName | ros::init_options::NoRosout);
  constexpr int kArguments = 3;
  const double seconds = argc == kArguments ? std::strtod(argv[2], nullptr) : 0.0;
  std::string problem = "expected two arguments: the bag and for how many seconds to listen";
  try {
    if (seconds > 0.0) problem = Record(argv[1], seconds);
  } catch (const std::exception& exception) {
    problem = fmt::format("{}: cannot be written: {}", argv[1], exception.what());
  }
  if (!problem.empty()) fmt::print(stderr, "planar_vslam: {}\n", problem);
  return problem.empty() ? 0 : 2;
}

}  // namespace
}  // namespace planar_vslam::ros_face

int main(int argc, char** argv) { return planar_vslam::ros_face::Main(argc, argv); }
