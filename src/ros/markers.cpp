#include "markers.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace planar_vslam::ros_face {
namespace {

using visualization_msgs::Marker;

constexpr int kLevels = 16;  // of an OctoMap

geometry_msgs::Point ToPoint(const Eigen::Vector3d& p) {
  geometry_msgs::Point point;
  point.x = p.x();
  point.y = p.y();
  point.z = p.z();
  return point;
}

std_msgs::ColorRGBA Color(double red, double green, double blue) {
  std_msgs::ColorRGBA color;
  color.r = static_cast<float>(red);
  color.g = static_cast<float>(green);
  color.b = static_cast<float>(blue);
  color.a = 1.0F;
  return color;
}

// Blue on the floor over green to red at a room's usual height.
std_msgs::ColorRGBA ColorOfHeight(double z) {
  constexpr double kRoom = 2.5;  // m
  const double at = std::clamp(z / kRoom, 0.0, 1.0);
  return Color(std::max(0.0, 2.0 * at - 1.0), 1.0 - std::abs(2.0 * at - 1.0), std::max(0.0, 1.0 - 2.0 * at));
}

Marker MakeMarker(const std_msgs::Header& header, const std::string& name, int id, int type, double scale) {
  Marker marker;
  marker.header = header;
  marker.ns = name;
  marker.id = id;
  marker.type = type;
  marker.pose.orientation.w = 1.0;
  marker.scale.x = marker.scale.y = marker.scale.z = scale;
  return marker;
}

// A list without points would be an error to rviz.
void Finish(Marker* marker) { marker->action = marker->points.empty() ? Marker::DELETE : Marker::ADD; }

void AddLine(const Map& map, const KeyframePair& ends, Marker* lines) {
  const Keyframe* from = map.keyframes.Find(ends.first);
  const Keyframe* to = map.keyframes.Find(ends.second);
  if (from == nullptr || to == nullptr) return;
  lines->points.push_back(ToPoint(from->T_map_base.translation));
  lines->points.push_back(ToPoint(to->T_map_base.translation));
}

}  // namespace

visualization_msgs::MarkerArray ToOctomapMarkers(const std_msgs::Header& header, double resolution,
                                                 const std::vector<OccupiedCube>& cubes) {
  visualization_msgs::MarkerArray array;
  for (int level = 0; level < kLevels; ++level) {
    array.markers.push_back(MakeMarker(header, "octomap", level, Marker::CUBE_LIST, std::ldexp(resolution, level)));
  }
  for (const OccupiedCube& cube : cubes) {
    const int level = static_cast<int>(std::lround(std::log2(cube.size / resolution)));
    Marker& marker = array.markers[static_cast<std::size_t>(std::clamp(level, 0, kLevels - 1))];
    marker.points.push_back(ToPoint(cube.center.cast<double>()));
    marker.colors.push_back(ColorOfHeight(cube.center.z()));
  }
  for (Marker& marker : array.markers) Finish(&marker);
  return array;
}

visualization_msgs::MarkerArray ToGraphMarkers(const std_msgs::Header& header, const Map& map,
                                               const std::vector<KeyframePair>& loops) {
  constexpr double kPoint = 0.06, kLine = 0.015, kLoop = 0.04;  // m; by what can be told apart on a screen
  Marker keyframes = MakeMarker(header, "keyframes", 0, Marker::SPHERE_LIST, kPoint);
  Marker wheels = MakeMarker(header, "odometry", 0, Marker::LINE_LIST, kLine);
  Marker laser = MakeMarker(header, "laser", 0, Marker::LINE_LIST, kLine);
  Marker closed = MakeMarker(header, "loops", 0, Marker::LINE_LIST, kLoop);
  keyframes.color = Color(1.0, 1.0, 0.2);
  wheels.color = Color(0.3, 0.7, 1.0);
  laser.color = Color(0.3, 0.9, 0.4);
  closed.color = Color(1.0, 0.2, 0.8);
  for (const auto& [id, keyframe] : map.keyframes) {
    keyframes.points.push_back(ToPoint(keyframe.T_map_base.translation));
    if (keyframe.odometry_link.has_value()) AddLine(map, {keyframe.odometry_link->from, id}, &wheels);
    for (const MotionLink& link : keyframe.laser_links) AddLine(map, {link.from, id}, &laser);
  }
  for (const KeyframePair& loop : loops) AddLine(map, loop, &closed);
  visualization_msgs::MarkerArray array;
  for (Marker* marker : {&keyframes, &wheels, &laser, &closed}) {
    Finish(marker);
    array.markers.push_back(*marker);
  }
  return array;
}

}  // namespace planar_vslam::ros_face
