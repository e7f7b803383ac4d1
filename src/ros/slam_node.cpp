// slam_node: topics and services on one side, the tracking thread on the other, a queue between them.
#include <image_transport/image_transport.h>
#include <planar_vslam/SaveMap.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_srvs/Trigger.h>

#include <algorithm>
#include <future>
#include <thread>

#include "input_queue.h"
#include "parameters.h"
#include "planar_vslam/io/message_values.h"
#include "publishers.h"
#include "tracking_loop.h"

namespace planar_vslam::ros_face {
namespace {

class SlamNode {
 public:
  SlamNode(const ros::NodeHandle& node, const NodeSettings& settings)
      : settings_(settings),
        node_(node),
        queue_(static_cast<std::size_t>(settings.queue_size_images), settings.lossless),
        localization_(&node_, settings),
        maps_(&node_, settings),
        diagnostics_(&node_, queue_),
        loop_(settings, node_.resolveName("image"),
              {[this](const FrameReport& report) { OnFrame(report); }, [this] { OnRestart(); },
               [](const std::string& reason) {
                 ROS_FATAL("map_file: %s", reason.c_str());
                 ros::requestShutdown();
               }}) {
    AdvertiseServices();
    Subscribe();
    thread_ = std::thread([this] { Track(); });
  }
  ~SlamNode() {
    queue_.Close();
    thread_.join();
  }

 private:
  // Messages roscpp itself keeps; the node's own queue decides what is dropped.
  std::uint32_t Backlog() const { return settings_.lossless ? 0 : 100; }

  void Subscribe() {
    SubscribeImages();
    Forward<sensor_msgs::CameraInfo>("camera_info");
    for (const bool is_static : {false, true}) {
      const auto push = [this, is_static](const tf2_msgs::TFMessageConstPtr& tf) {
        if (settings_.odometry == OdometrySource::kTf) NoteOdometry(*tf);
        queue_.Push(TfInput{tf, is_static});
      };
      subscribers_.push_back(node_.subscribe<tf2_msgs::TFMessage>(is_static ? "/tf_static" : "/tf", Backlog(), push));
    }
    if (!settings_.with_odometry()) return;
    Forward<sensor_msgs::LaserScan>("scan");
    if (settings_.odometry != OdometrySource::kTopic) return;
    const auto push = [this](const nav_msgs::OdometryConstPtr& odometry) {
      localization_.OnOdometry(odometry->header.stamp);
      queue_.Push(odometry);
    };
    subscribers_.push_back(node_.subscribe<nav_msgs::Odometry>("odom", Backlog(), push));
  }

  template <class Message>
  void Forward(const std::string& topic) {
    using Pointer = boost::shared_ptr<const Message>;
    const auto push = [this](const Pointer& message) { queue_.Push(message); };
    subscribers_.push_back(node_.subscribe<Message>(topic, Backlog(), push));
  }

  // Compressed images need no plugin: they are decoded here.
  void SubscribeImages() {
    if (settings_.image_transport == "compressed") {
      Forward<sensor_msgs::CompressedImage>(node_.resolveName("image") + "/compressed");
      return;
    }
    const auto push = [this](const sensor_msgs::ImageConstPtr& image) { queue_.Push(image); };
    image_ = image_transport::ImageTransport(node_).subscribe(
        "image", Backlog(), push, ros::VoidPtr(), image_transport::TransportHints(settings_.image_transport));
  }

  void NoteOdometry(const tf2_msgs::TFMessage& tf) {
    for (const geometry_msgs::TransformStamped& transform : tf.transforms) {
      if (io::FrameName(transform.header.frame_id) != settings_.pipeline.topics.odom_frame) continue;
      localization_.OnOdometry(transform.header.stamp);
    }
  }

  // On a queue and thread of their own: a service that waits must not hold up the sensors.
  void AdvertiseServices() {
    ros::NodeHandle services(node_);
    services.setCallbackQueue(&service_queue_);
    servers_.push_back(services.advertiseService("save_map", &SlamNode::OnSaveMap, this));
    servers_.push_back(services.advertiseService("reset", &SlamNode::OnReset, this));
    service_spinner_.start();
  }

  void Track() {
    while (const std::optional<Input> input = queue_.Pop()) {
      loop_.Handle(*input);
      diagnostics_.OnInput(loop_);
    }
  }

  void OnFrame(const FrameReport& report) {
    localization_.OnFrame(report);
    diagnostics_.OnFrame(report);
    maps_.OnFrame(loop_, report.stamp);
  }
  void OnRestart() {
    localization_.OnRestart();
    maps_.OnRestart();
  }

  // What `ask` gives on the tracking thread; throws std::future_error when the node stops before.
  template <class Value>
  Value OnTrackingThread(const std::function<Value()>& ask) {
    auto answer = std::make_shared<std::promise<Value>>();
    std::future<Value> future = answer->get_future();
    queue_.Push(Command([ask, answer = std::move(answer)] { answer->set_value(ask()); }));
    return future.get();
  }

  bool OnSaveMap(SaveMap::Request& request, SaveMap::Response& response) {
    using MaybeSnapshot = std::optional<EstimatorSnapshot>;
    const MaybeSnapshot snapshot = OnTrackingThread<MaybeSnapshot>([this] { return loop_.Snapshot(); });
    if (!snapshot.has_value()) {
      response.message = "there is no map yet";
      return true;
    }
    const Expected<std::filesystem::path> file = SaveGrid(*snapshot, settings_, request.name);
    response.success = file.ok();
    response.message = file.ok() ? file->string() : file.error().message;
    return true;
  }

  bool OnReset(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
    response.success = OnTrackingThread<bool>([this] {
      loop_.Restart();
      return true;
    });
    response.message = "map and trajectory dropped";
    return true;
  }

  const NodeSettings settings_;
  ros::NodeHandle node_;
  InputQueue queue_;
  LocalizationPublisher localization_;
  MapPublisher maps_;
  DiagnosticsPublisher diagnostics_;
  TrackingLoop loop_;
  std::thread thread_;
  std::vector<ros::Subscriber> subscribers_;
  image_transport::Subscriber image_;
  ros::CallbackQueue service_queue_;
  ros::AsyncSpinner service_spinner_{1, &service_queue_};
  std::vector<ros::ServiceServer> servers_;
};

int Run() {
  constexpr int kExitBadInput = 2;
  std::vector<std::string> problems;
  // Outlives everything: roscpp shuts down, its console first, with the last handle.
  const ros::NodeHandle private_node("~");
  const NodeSettings settings = ReadSettings(private_node, &problems);
  for (const std::string& problem : problems) ROS_FATAL("%s", problem.c_str());
  if (!problems.empty()) return kExitBadInput;
  try {
    SlamNode node(ros::NodeHandle(), settings);
    ros::spin();
  } catch (const image_transport::TransportLoadException& exception) {
    ROS_FATAL("image_transport: %s", exception.what());
    return kExitBadInput;
  }
  return 0;
}

}  // namespace
}  // namespace planar_vslam::ros_face

int main(int argc, char** argv) {
  ros::init(argc, argv, "slam_node");
  return planar_vslam::ros_face::Run();
}
