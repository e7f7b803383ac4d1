#pragma once
// What the node says: where the robot is, what the world looks like, how it is doing.
#include <nav_msgs/OccupancyGrid.h>
#include <ros/node_handle.h>
#include <tf2_ros/transform_broadcaster.h>

#include <atomic>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "markers.h"
#include "octomap_topics.h"
#include "parameters.h"
#include "planar_vslam/pipeline/executor.h"
#include "planar_vslam/pipeline/navigation_map.h"
#include "tracking_loop.h"

namespace planar_vslam::ros_face {

// `pose` with every frame, tf map -> odom at a steady rate. Safe to call from several threads.
class LocalizationPublisher {
 public:
  LocalizationPublisher(ros::NodeHandle* node, const NodeSettings& settings);

  void OnFrame(const FrameReport& report);
  void OnRestart();
  void Apply(const RunTimeSettings& settings);
  // Of the newest odometry that has arrived, tracked or not.
  void OnOdometry(const ros::Time& stamp);

 private:
  void Broadcast();

  const NodeSettings settings_;
  ros::Publisher pose_;
  tf2_ros::TransformBroadcaster broadcaster_;
  std::mutex mutex_;
  double transform_tolerance_;  // s
  std::optional<Rigid2> T_map_odom_;
  ros::Time odometry_stamp_, broadcast_stamp_;
  ros::Timer timer_;  // last: stops before the rest goes
};

// `map`, `map_updates`, `map_points`, `path`, `keyframes`, `graph` and those of the OctoMap, built on a thread of their
// own from snapshots. `map` comes whole to who subscribes and whenever its bounds change; in between `map_updates` has
// the changed rectangle.
class MapPublisher {
 public:
  MapPublisher(ros::NodeHandle* node, const NodeSettings& settings);
  // By the builder, after what it is at; it does what waits before it ends.
  ~MapPublisher() {
    builder_.Submit([this] { octomap_->Shutdown(); });
  }
  MapPublisher(const MapPublisher&) = delete;
  MapPublisher& operator=(const MapPublisher&) = delete;

  // On the tracking thread, after a frame: takes a snapshot when something is due and the builder is idle.
  void OnFrame(const TrackingLoop& loop, Timestamp stamp);
  // The map so far is void: subscribers get a grid of unknown cells, and no points, path and keyframes.
  void OnRestart();
  // From any thread. The band counts from the next grid on.
  void Apply(const RunTimeSettings& settings);
  // With what was applied.
  NodeSettings settings() const;
  // As published last; nothing before, and after a restart.
  std::optional<nav_msgs::OccupancyGrid> grid();

 private:
  // `generation`: of maps, as it was when the snapshot was taken.
  void Publish(const EstimatorSnapshot& snapshot, const std::vector<KeyframePair>& loops, bool grid_due,
               long generation);
  void PublishGrid(const std_msgs::Header& header, const OccupancyGrid2d& grid, long generation);
  RunTimeSettings run_time() const;
  // On the builder's thread: of the map as it was updated last, unless that is void.
  void PublishOctomap();
  void OnMapSubscriber(const ros::SingleSubscriberPublisher& subscriber);

  const NodeSettings settings_;
  mutable std::mutex run_time_mutex_;
  RunTimeSettings run_time_;
  NavigationMap navigation_;         // of the builder's thread
  std_msgs::Header octomap_header_;  // likewise
  long octomap_generation_ = -1;     // likewise; none yet
  std::mutex mutex_;
  std::optional<OccupancyGrid2d> grid_;  // as published last
  long generation_ = 0;                  // a restart begins a new one: what is built of maps before is dropped
  std_msgs::Header grid_header_;
  ros::Publisher map_, map_updates_, map_points_, path_, keyframes_, graph_;
  std::optional<OctomapTopics> octomap_;  // never empty
  std::optional<Timestamp> last_grid_, last_points_;
  std::atomic<bool> building_{false};
  WorkerExecutor builder_;  // last: its jobs end before the rest goes
};

// `/diagnostics` once a second of wall time, so that a stopped clock shows too.
class DiagnosticsPublisher {
 public:
  // `name` of the node or nodelet.
  DiagnosticsPublisher(ros::NodeHandle* node, const std::string& name, const InputQueue& queue);

  // On the tracking thread.
  void OnFrame(const FrameReport& report);
  void OnInput(const TrackingLoop& loop);

 private:
  struct Status {
    std::optional<FrameReport> frame;
    std::string waiting_for;  // of the oldest waiting image
    std::size_t keyframes = 0, points = 0;
    std::size_t loops = 0;
    std::map<std::string, long> failed_adjustments, unused;
    StageStatistics stages;
    long frames = 0;
    std::vector<std::string> findings;
  };
  void Publish();

  const InputQueue& queue_;
  const std::string name_;
  ros::Publisher publisher_;
  std::mutex mutex_;
  Status status_;
  long frames_before_ = 0;
  ros::WallTime findings_time_;  // of the tracking thread
  ros::WallTimer timer_;         // last: stops before the rest goes
};

}  // namespace planar_vslam::ros_face
