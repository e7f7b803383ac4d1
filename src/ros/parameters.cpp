#include "parameters.h"

#include <fmt/format.h>

#include "parameter_reader.h"
#include "run_time_server.h"

namespace planar_vslam::ros_face {
namespace {

void ReadOdometrySource(const std::string& source, NodeSettings* settings, std::vector<std::string>* problems) {
  if (source == "topic") {
    settings->odometry = OdometrySource::kTopic;
  } else if (source == "tf") {
    settings->odometry = OdometrySource::kTf;
  } else if (source == "none") {
    settings->odometry = OdometrySource::kNone;
  } else {
    problems->push_back(fmt::format("odometry_source: is '{}'; expected topic, tf or none", source));
  }
  const OdometryUse use = settings->pipeline.odometry;
  if (use == OdometryUse::kRequired && !settings->with_odometry()) {
    problems->push_back("odometry_source: is none, but the configuration requires odometry");
  }
  // Without a base there is nothing odometry could be about.
  if (use == OdometryUse::kOff || !settings->has_base()) settings->odometry = OdometrySource::kNone;
}

void ReadSavedMap(const std::string& file, NodeSettings* settings, std::vector<std::string>* problems) {
  if (file.empty()) {
    if (settings->pipeline.mode == RunMode::kLocalization) {
      problems->push_back("mode: is localization; expected the map to localize in as map_file");
    }
    return;
  }
  Expected<SavedMap> saved = LoadMapFile(file);
  if (!saved.ok()) {
    problems->push_back("map_file: " + saved.error().message);
    return;
  }
  settings->saved_map = std::make_shared<const SavedMap>(std::move(saved).value());
}

}  // namespace

RunTimeSettings RunTimeOf(const NodeSettings& settings) {
  const MapBuilderOptions& grid = settings.pipeline.mapping2d;
  return {settings.tf_rate,    settings.transform_tolerance,
          settings.map_period, settings.map_points_period,
          grid.band_min,       grid.band_max};
}

NodeSettings With(NodeSettings settings, const RunTimeSettings& run_time) {
  settings.tf_rate = run_time.tf_rate;
  settings.transform_tolerance = run_time.transform_tolerance;
  settings.map_period = run_time.map_period;
  settings.map_points_period = run_time.map_points_period;
  settings.pipeline.mapping2d.band_min = run_time.band_min;
  settings.pipeline.mapping2d.band_max = run_time.band_max;
  return settings;
}

NodeSettings ReadSettings(const ros::NodeHandle& node, std::vector<std::string>* problems) {
  NodeSettings settings;
  std::string config, map_file, mode, odometry_source = "topic", map_directory = settings.map_directory.string();
  std::vector<std::string> assignments;
  ParameterReader reader(node, problems);
  reader.Read("config", "a file name", &config);
  reader.Read("set", "a list of key=value", &assignments);
  reader.Read("odometry_source", "topic, tf or none", &odometry_source);
  reader.Read("image_transport", "raw, compressed or the name of a plugin", &settings.image_transport);
  reader.Read("map_frame", "a frame name", &settings.map_frame);
  reader.Read("publish_tf", "true or false", &settings.publish_tf);
  reader.Read("publish_tf_before_fix", "true or false", &settings.publish_tf_before_fix);
  reader.Read("tf_rate", "a number (Hz)", &settings.tf_rate);
  reader.Read("transform_tolerance", "a number (s)", &settings.transform_tolerance);
  reader.Read("map_period", "a number (s)", &settings.map_period);
  reader.Read("map_points_period", "a number (s)", &settings.map_points_period);
  reader.Read("map_directory", "a folder name", &map_directory);
  reader.Read("map_file", "a file name", &map_file);
  reader.Read("mode", "mapping or localization", &mode);
  reader.Read("path_frames", "a whole number", &settings.path_frames);
  reader.Read("queue_size_images", "a whole number", &settings.queue_size_images);
  reader.Read("lossless", "true or false", &settings.lossless);
  reader.RequirePositive("path_frames", settings.path_frames);
  reader.RequirePositive("queue_size_images", settings.queue_size_images);
  if (settings.map_frame.empty()) problems->push_back("map_frame: is empty; expected a frame name");
  // Left there by a node before: at the start the configuration counts.
  for (const char* name : {"obstacle_band_min", "obstacle_band_max"}) reader.Ignore(name);
  reader.RefuseUnknown();
  settings.map_directory = map_directory;
  if (!mode.empty()) assignments.push_back("mode=" + mode);
  settings.pipeline = CollectOptions(config, assignments, problems);
  for (const std::string& problem : RunTimeProblems(RunTimeOf(settings))) problems->push_back(problem);
  ReadOdometrySource(odometry_source, &settings, problems);
  ReadSavedMap(map_file, &settings, problems);
  return settings;
}

}  // namespace planar_vslam::ros_face
