// mapping2d_node: grid, OctoMap and points of a saved map, without tracking.
#include <fmt/format.h>
#include <nav_msgs/GetMap.h>
#include <ros/ros.h>

#include <string>
#include <vector>

#include "converters.h"
#include "markers.h"
#include "octomap_topics.h"
#include "parameter_reader.h"
#include "planar_vslam/map/map_file.h"
#include "planar_vslam/pipeline/navigation_map.h"
#include "planar_vslam/pipeline/options.h"

namespace planar_vslam::ros_face {
namespace {

struct Mapping2dSettings {
  PipelineOptions pipeline;
  SavedMap saved;
  std::string map_frame = "map";
};

Mapping2dSettings ReadMapping2dSettings(const ros::NodeHandle& node, std::vector<std::string>* problems) {
  Mapping2dSettings settings;
  std::string config, map_file;
  std::vector<std::string> assignments;
  ParameterReader reader(node, problems);
  reader.Read("config", "a file name", &config);
  reader.Read("set", "a list of key=value", &assignments);
  reader.Read("map_file", "a file name", &map_file);
  reader.Read("map_frame", "a frame name", &settings.map_frame);
  reader.RefuseUnknown();
  if (settings.map_frame.empty()) problems->push_back("map_frame: is empty; expected a frame name");
  settings.pipeline = CollectOptions(config, assignments, problems);
  Expected<SavedMap> saved = LoadMapFile(map_file);
  if (!saved.ok()) {
    problems->push_back("map_file: " + saved.error().message);
    return settings;
  }
  settings.saved = std::move(saved).value();
  if (!settings.saved.map.metric) problems->push_back("map_file: has no metric scale; a grid needs metres");
  return settings;
}

template <class Message>
ros::Publisher Latch(ros::NodeHandle* node, const std::string& topic, const Message& message) {
  ros::Publisher publisher = node->advertise<Message>(topic, 1, true);
  publisher.publish(message);
  return publisher;
}

int Run() {
  constexpr int kExitBadInput = 2;
  std::vector<std::string> problems;
  const ros::NodeHandle private_node("~");
  const Mapping2dSettings settings = ReadMapping2dSettings(private_node, &problems);
  for (const std::string& problem : problems) ROS_FATAL("%s", problem.c_str());
  if (!problems.empty()) return kExitBadInput;

  const MapBuilder builder = BuildNavigationMap(settings.saved.map, settings.saved.camera, settings.pipeline.mapping2d,
                                                LandmarkAcceptance::For(settings.pipeline.pixel_sigma));
  std_msgs::Header header;
  header.stamp = ros::Time::now();
  header.frame_id = settings.map_frame;
  const std::vector<OccupiedCube> cubes = builder.OccupiedCubes();
  if (cubes.empty()) {
    const MapBuilderOptions& o = settings.pipeline.mapping2d;
    ROS_WARN(
        "no voxel is occupied: the map has no sweeps, and no landmark within mapping2d.visual_range (%.1f m) is "
        "known to mapping2d.visual_hit_sigma (%.2f m)",
        o.visual_range, o.visual_hit_sigma);
  }
  const auto tree = [&](OctomapForm form) {
    return ToOctomap(header, settings.pipeline.mapping2d.resolution, builder.OctomapData(form), form);
  };
  const nav_msgs::OccupancyGrid grid = ToOccupancyGrid(header, builder.Grid());
  ros::NodeHandle node;
  const std::vector<ros::Publisher> publishers{
      Latch(&node, "map", grid),
      Latch(&node, "octomap_markers", ToOctomapMarkers(header, settings.pipeline.mapping2d.resolution, cubes)),
      Latch(&node, "octomap_binary", tree(OctomapForm::kBinary)),
      Latch(&node, "octomap_full", tree(OctomapForm::kFull)),
      Latch(&node, "graph", ToGraphMarkers(header, settings.saved.map, {})),
      Latch(&node, "map_points", ToPointCloud(header, LandmarkCloud(settings.saved.map)))};
  using Get = nav_msgs::GetMap;
  const boost::function<bool(Get::Request&, Get::Response&)> get = [&grid](Get::Request&, Get::Response& response) {
    response.map = grid;
    return true;
  };
  const ros::ServiceServer server = node.advertiseService("static_map", get);
  ros::spin();
  return 0;
}

}  // namespace
}  // namespace planar_vslam::ros_face

int main(int argc, char** argv) {
  ros::init(argc, argv, "mapping2d_node");
  return planar_vslam::ros_face::Run();
}
