#pragma once
// The tracking thread's work: one input after the other through tf, Synchronizer and SlamSystem. Knows no threads.
#include <tf2/buffer_core.h>

#include <array>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "input_queue.h"
#include "parameters.h"
#include "planar_vslam/pipeline/input_corrector.h"
#include "planar_vslam/pipeline/slam_system.h"
#include "planar_vslam/pipeline/synchronizer.h"
#include "planar_vslam/planar/message_covariance.h"

namespace planar_vslam::ros_face {

// All that a navigation map is built from, as values another thread may keep.
struct MapSnapshot {
  std::shared_ptr<const Map> map;
  TrajectoryRecorder trajectory;
  CameraModel camera;
  Timestamp stamp;  // of the last frame
};

struct TrackingEvents {
  std::function<void(const FrameReport&, const std::optional<Rigid2>& T_odom_base)> on_frame;
  std::function<void()> on_restart;  // map and poses so far are void
};

class TrackingLoop {
 public:
  // `image_topic` as subscribed, for messages and to know rectified images.
  TrackingLoop(const NodeSettings& settings, const std::string& image_topic, TrackingEvents events);

  void Handle(const Input& input);
  // Drops the map and starts over.
  void Restart();
  // Nothing while there is no map.
  std::optional<MapSnapshot> Snapshot() const;

  // What the oldest waiting image waits for; empty when none does.
  const std::string& waiting_for() const { return waiting_for_; }
  // Input that could not be used, by reason.
  std::map<std::string, long> unused() const;
  std::shared_ptr<const Map> map() const { return system_ != nullptr ? system_->map() : nullptr; }

 private:
  struct WaitingImage {
    Timestamp stamp;
    std::string frame_id;
    std::function<Expected<GrayImage>()> decode;
  };
  struct WaitingOdometry {
    Timestamp stamp;
    nav_msgs::OdometryConstPtr message;  // null: of tf
  };
  struct WaitingScan {
    Timestamp stamp;
    sensor_msgs::LaserScanConstPtr message;
  };
  enum class Stream { kImage, kOdometry, kScan };

  void On(const sensor_msgs::ImageConstPtr& image);
  void On(const sensor_msgs::CompressedImageConstPtr& image);
  void On(const sensor_msgs::CameraInfoConstPtr& info);
  void On(const nav_msgs::OdometryConstPtr& odometry);
  void On(const sensor_msgs::LaserScanConstPtr& scan);
  void On(const TfInput& tf);
  void On(const Command& command) { command(); }

  template <class Message>
  void AddImage(const Message& image);
  // Counts and refuses a stamp of zero; starts over when time has jumped back.
  bool AcceptStamp(Stream stream, const ros::Time& stamp);
  void Drain();
  // Each takes what it can be used for; false: it has to wait.
  bool Use(const WaitingImage& image);
  bool Use(const WaitingOdometry& odometry);
  bool Use(const WaitingScan& scan);
  template <class Waiting>
  void UseInOrder(std::deque<Waiting>* waiting, const char* what);
  void StartSystem();
  void Process();
  // T_parent_child at `stamp`; nothing while tf does not reach that far.
  std::optional<Rigid3> LookUp(const std::string& parent, const std::string& child, Timestamp stamp) const;

  const NodeSettings settings_;
  const std::string image_topic_;
  const TrackingEvents events_;
  const std::string base_frame_, odom_frame_;
  tf2::BufferCore tf_;
  std::optional<CameraModel> camera_;
  std::deque<WaitingImage> images_;
  std::deque<WaitingOdometry> odometry_;
  std::deque<WaitingScan> scans_;
  std::optional<Timestamp> last_odometry_;  // handed to the synchronizer
  OdometryBuffer wheels_;  // the odometry frame as tf has it, uncorrected, on the camera's clock: for map -> odom
  std::array<std::optional<Timestamp>, 3> newest_;  // by stream
  InputCorrector corrector_;
  MessageCovarianceReader covariance_;
  Synchronizer synchronizer_;
  std::unique_ptr<SlamSystem> system_;
  Timestamp last_frame_;
  std::string waiting_for_;
  std::map<std::string, long> unused_;
};

}  // namespace planar_vslam::ros_face
