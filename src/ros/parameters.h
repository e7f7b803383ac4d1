#pragma once
// The node's private parameters.
#include <ros/node_handle.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "planar_vslam/map/map_file.h"
#include "planar_vslam/pipeline/options.h"

namespace planar_vslam::ros_face {

enum class OdometrySource { kTopic, kTf, kNone };

struct NodeSettings {
  PipelineOptions pipeline;                          // ~config (YAML file), then ~set (list of key=value)
  OdometrySource odometry = OdometrySource::kTopic;  // ~odometry_source: topic, tf or none
  std::string image_transport = "raw";               // raw, compressed, or the name of an image_transport plugin
  std::string map_frame = "map";
  bool publish_tf = true;                     // map -> odom
  bool publish_tf_before_fix = false;         // as identity, until there is a map
  double tf_rate = 30.0;                      // Hz
  double transform_tolerance = 0.1;           // s that map -> odom is dated after the latest odometry
  double map_period = 5.0;                    // s between occupancy grids
  double map_points_period = 1.0;             // s between point clouds, paths and keyframe lists
  std::filesystem::path map_directory = ".";  // save_map writes here and nowhere else
  std::shared_ptr<const SavedMap> saved_map;  // ~map_file: the map to start from; null: a new one
  int path_frames = 3000;                     // latest frames that `path` shows, and up to twice as many
  int queue_size_images = 3;                  // images that wait for tracking; older ones are dropped
  bool lossless = false;                      // drop nothing, map each keyframe at once: for recordings, not for robots

  bool with_odometry() const { return odometry != OdometrySource::kNone; }
  bool has_base() const { return !pipeline.topics.base_frame.empty(); }
};

// What may change while the node runs (cfg/Slam.cfg).
struct RunTimeSettings {
  double tf_rate = 0.0;                   // Hz
  double transform_tolerance = 0.0;       // s
  double map_period = 0.0;                // s
  double map_points_period = 0.0;         // s
  double band_min = 0.0, band_max = 0.0;  // m, heights that are obstacles of the grid
};
RunTimeSettings RunTimeOf(const NodeSettings& settings);
// The settings with these in their place.
NodeSettings With(NodeSettings settings, const RunTimeSettings& run_time);

// One line in `problems` for everything that is wrong, unknown parameters included.
NodeSettings ReadSettings(const ros::NodeHandle& node, std::vector<std::string>* problems);

}  // namespace planar_vslam::ros_face
