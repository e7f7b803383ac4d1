#include "slam_app.h"

#include <image_transport/image_transport.h>

#include <optional>
#include <utility>

#include "debug_image.h"
#include "planar_vslam/io/message_values.h"
#include "publishers.h"
#include "run_time_server.h"
#include "services.h"
#include "state_publisher.h"
#include "tracking_thread.h"

namespace planar_vslam::ros_face {

class SlamApp::Implementation {
 public:
  Implementation(const ros::NodeHandle& node, const ros::NodeHandle& private_node, const std::string& name,
                 const NodeSettings& settings, std::function<void(const std::string&)> on_map_refused)
      : settings_(settings),
        node_(node),
        localization_(&node_, settings),
        maps_(&node_, settings),
        state_(&node_, settings),
        debug_image_(node_, settings),
        tracking_(settings, node_.resolveName("image"),
                  {[this](const FrameReport& report) { reports_.push_back(report); }, [this] { OnRestart(); },
                   std::move(on_map_refused)},
                  [this](const TrackingLoop& loop) { OnInput(loop); }),
        diagnostics_(&node_, name, tracking_.queue()),
        services_(std::in_place, node_, settings, &tracking_, &maps_),
        run_time_(private_node, RunTimeOf(settings), [this](const RunTimeSettings& run_time) {
          localization_.Apply(run_time);
          maps_.Apply(run_time);
        }) {
    Subscribe();
    tracking_.Start();
  }
  ~Implementation() {
    tracking_.Stop();
    services_.reset();
  }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

 private:
  // Messages roscpp itself keeps; the node's own queue decides what is dropped.
  std::uint32_t Backlog() const { return settings_.lossless ? 0 : 100; }

  template <class Message, class Callback>
  void Listen(const std::string& topic, const Callback& on_message) {
    using Pointer = boost::shared_ptr<const Message>;
    const boost::function<void(const Pointer&)> callback = on_message;
    subscribers_.push_back(node_.subscribe<Message>(topic, Backlog(), callback, ros::VoidPtr(), AtOnce()));
  }
  // Else TCP holds small messages, and the end of large ones, back until what came before is acknowledged: up to 40 ms.
  static ros::TransportHints AtOnce() { return ros::TransportHints().tcpNoDelay(); }

  void Subscribe() {
    SubscribeImages();
    Forward<sensor_msgs::CameraInfo>("camera_info");
    for (const bool is_static : {false, true}) {
      const auto push = [this, is_static](const tf2_msgs::TFMessageConstPtr& tf) {
        if (settings_.odometry == OdometrySource::kTf) NoteOdometry(*tf);
        tracking_.Push(TfInput{tf, is_static});
      };
      Listen<tf2_msgs::TFMessage>(is_static ? "/tf_static" : "/tf", push);
    }
    if (!settings_.with_odometry()) return;
    Forward<sensor_msgs::LaserScan>("scan");
    if (settings_.odometry != OdometrySource::kTopic) return;
    const auto push = [this](const nav_msgs::OdometryConstPtr& odometry) {
      localization_.OnOdometry(odometry->header.stamp);
      tracking_.Push(odometry);
    };
    Listen<nav_msgs::Odometry>("odom", push);
  }

  template <class Message>
  void Forward(const std::string& topic) {
    Listen<Message>(topic, [this](const boost::shared_ptr<const Message>& message) { tracking_.Push(message); });
  }

  // Compressed images need no plugin: they are decoded here.
  void SubscribeImages() {
    if (settings_.image_transport == "compressed") {
      Forward<sensor_msgs::CompressedImage>(node_.resolveName("image") + "/compressed");
      return;
    }
    const auto push = [this](const sensor_msgs::ImageConstPtr& image) { tracking_.Push(image); };
    image_ = image_transport::ImageTransport(node_).subscribe(
        "image", Backlog(), push, ros::VoidPtr(), image_transport::TransportHints(settings_.image_transport, AtOnce()));
  }

  void NoteOdometry(const tf2_msgs::TFMessage& tf) {
    for (const geometry_msgs::TransformStamped& transform : tf.transforms) {
      if (io::FrameName(transform.header.frame_id) != settings_.pipeline.topics.odom_frame) continue;
      localization_.OnOdometry(transform.header.stamp);
    }
  }

  // On the tracking thread.
  void OnInput(const TrackingLoop& loop) {
    for (const FrameReport& report : reports_) {
      localization_.OnFrame(report);
      state_.OnFrame(report, loop);
      diagnostics_.OnFrame(report);
      maps_.OnFrame(loop, report.stamp);
    }
    if (!reports_.empty()) debug_image_.OnFrame(reports_.back(), loop);
    reports_.clear();
    state_.OnInput(loop);
    diagnostics_.OnInput(loop);
  }
  void OnRestart() {
    reports_.clear();
    localization_.OnRestart();
    state_.OnRestart();
    maps_.OnRestart();
  }

  const NodeSettings settings_;
  ros::NodeHandle node_;
  std::vector<FrameReport> reports_;  // of the input at hand; of the tracking thread
  LocalizationPublisher localization_;
  MapPublisher maps_;
  StatePublisher state_;
  DebugImagePublisher debug_image_;
  TrackingThread tracking_;
  DiagnosticsPublisher diagnostics_;
  std::optional<Services> services_;
  RunTimeServer run_time_;
  std::vector<ros::Subscriber> subscribers_;
  image_transport::Subscriber image_;
};

SlamApp::SlamApp(const ros::NodeHandle& node, const ros::NodeHandle& private_node, const std::string& name,
                 const NodeSettings& settings, std::function<void(const std::string&)> on_map_refused)
    : implementation_(std::make_unique<Implementation>(node, private_node, name, settings, std::move(on_map_refused))) {
}

SlamApp::~SlamApp() = default;

}  // namespace planar_vslam::ros_face
