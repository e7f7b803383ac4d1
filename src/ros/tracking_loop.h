#pragma once
// The tracking thread's work: messages become measurements, through tf, and go to the Estimator one after the other.
// Knows no threads.
#include <geometry_msgs/PoseWithCovarianceStamped.h>
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
#include "planar_vslam/io/odometry_messages.h"
#include "planar_vslam/pipeline/estimator.h"

namespace planar_vslam::ros_face {

// Stamps that go back further than messages ever overtake each other: a recording has been started again.
constexpr double kTimeJumpSeconds = 1.0;

struct TrackingEvents {
  std::function<void(const FrameReport&)> on_frame;
  std::function<void()> on_restart;                        // map and poses so far are void
  std::function<void(const std::string&)> on_map_refused;  // the map to start from does not fit; nothing is tracked
};

class TrackingLoop {
 public:
  // `image_topic` as subscribed, for messages and to know rectified images.
  TrackingLoop(const NodeSettings& settings, const std::string& image_topic, TrackingEvents events);

  void Handle(const Input& input);
  // Drops the map and starts over.
  void Restart();
  // Commands that may come at any time. One that cannot be carried out is an Error of one line and changes nothing.
  Expected<bool> LoadMap(const SavedMap& saved);
  Expected<bool> SetMode(RunMode mode);
  Expected<bool> StartAt(const geometry_msgs::PoseWithCovarianceStamped& pose);
  Expected<bool> AdjustMap();
  // Forgets where the robot is, not the map. In mode localization only: a map that grows has to know.
  Expected<bool> FindPlaceAnew();
  // A pause is as if the camera were silent.
  void Pause(bool paused);
  bool paused() const { return paused_; }
  RunMode mode() const { return estimator_ != nullptr ? estimator_->mode() : settings_.pipeline.mode; }

  // Nothing while there is no map.
  std::optional<EstimatorSnapshot> Snapshot() const;

  // What the oldest waiting image waits for; empty when none does.
  std::string waiting_for() const;
  // Input that could not be used, by reason.
  std::map<std::string, long> unused() const;
  std::shared_ptr<const Map> map() const { return estimator_ != nullptr ? estimator_->map() : nullptr; }
  const std::string& image_frame() const { return image_frame_; }  // of the last image used
  // Null before the first image whose camera is known.
  const Estimator* estimator() const { return estimator_.get(); }

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
  // Whether an image needs what has come in.
  bool ImageWaits() const;
  void StartEstimator();
  // The estimator, made now if there is none yet; an Error while the camera is not known.
  Expected<Estimator*> RequireEstimator();
  void ForgetInput();
  void Report(const std::vector<FrameReport>& frames);
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
  std::array<std::optional<Timestamp>, 3> newest_;  // by stream
  io::OdometryMessages odometry_messages_;
  io::OdometrySurvey odometry_survey_;
  io::GreyDepth depth_;  // of the images
  std::unique_ptr<Estimator> estimator_;
  std::string image_frame_;
  bool paused_ = false;
  bool refused_ = false;  // the map to start from does not fit
  std::string waiting_for_;
  std::map<std::string, long> unused_;
};

}  // namespace planar_vslam::ros_face
