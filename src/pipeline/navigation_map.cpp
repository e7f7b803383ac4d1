#include "planar_vslam/pipeline/navigation_map.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "planar_vslam/geometry/triangulation.h"

namespace planar_vslam {
namespace {

// Widest angle between the rays from the observers to the landmark, and the depth sigma it gives at `distance`.
double WidestParallax(const Map& map, const Landmark& landmark) {
  double widest = 0.0;
  const Eigen::Vector3d first = map.keyframes.At(landmark.observations.front().keyframe).T_map_camera().translation;
  for (const Observation& o : landmark.observations) {
    const Eigen::Vector3d center = map.keyframes.At(o.keyframe).T_map_camera().translation;
    widest = std::max(widest, ParallaxAngle(landmark.p_map, first, center));
  }
  return widest;
}

// Depth sigma of a ray intersection: the pixel's angle times distance over the sine of the parallax.
std::optional<double> AcceptedDepthSigma(const Map& map, const Landmark& landmark, double distance,
                                         const CameraModel& camera, const LandmarkAcceptance& a) {
  if (static_cast<int>(landmark.observations.size()) < a.min_observations || landmark.p_map.z() < a.min_height)
    return std::nullopt;
  const double parallax = WidestParallax(map, landmark);
  if (parallax < a.min_parallax) return std::nullopt;
  const double sigma = distance * (a.pixel_sigma / camera.fx) / std::sin(std::min(parallax, M_PI / 2.0));
  if (sigma > a.max_relative_depth_sigma * distance) return std::nullopt;
  return sigma;
}

PosedPoints PointsSeenBy(const Map& map, const Keyframe& keyframe, const CameraModel& camera,
                         const LandmarkAcceptance& a) {
  PosedPoints points;
  points.camera_in_map = keyframe.T_map_camera().translation;
  for (const LandmarkId id : keyframe.landmarks) {
    if (!id.valid()) continue;
    const Landmark& landmark = map.landmarks.At(id);
    const double distance = (landmark.p_map - points.camera_in_map).norm();
    const std::optional<double> sigma = AcceptedDepthSigma(map, landmark, distance, camera, a);
    if (sigma.has_value()) points.points.push_back({landmark.p_map, *sigma});
  }
  return points;
}

// Steps along the straight line that odometry says was driven; a curve's chord is not where the robot was.
void MarkDrivenLine(const Map& map, const Keyframe& keyframe, MapBuilder* builder) {
  if (!keyframe.odometry_link.has_value()) return;
  constexpr double kStep = 0.05;           // m
  constexpr double kStraight = 1.02;       // driven distance over chord
  constexpr double kTurnOnTheSpot = 0.05;  // m of driven distance that no chord needs to explain
  const Eigen::Vector2d from = map.keyframes.At(keyframe.odometry_link->from).T_map_base.translation.head<2>();
  const Eigen::Vector2d to = keyframe.T_map_base.translation.head<2>();
  const double chord = (to - from).norm();
  if (keyframe.odometry_link->odometry.distance > kStraight * chord + kTurnOnTheSpot) return;
  const int steps = static_cast<int>(chord / kStep);
  for (int i = 1; i <= steps; ++i) builder->MarkFootprint(from + (to - from) * (i * kStep / chord));
}

void InsertSweeps(const Keyframe& keyframe, MapBuilder* builder) {
  const Rigid2 T_map_keyframe = ProjectToPlane(keyframe.T_map_base);
  for (const LaserSweep& sweep : keyframe.sweeps) {
    const Rigid2 T_map_base = T_map_keyframe * sweep.T_keyframe_base;
    builder->InsertScan({Embed3(T_map_base) * sweep.T_base_laser, sweep.scan->angle_min, sweep.scan->angle_increment,
                         sweep.scan->range_min, sweep.scan->range_max, &sweep.scan->ranges});
    builder->MarkFootprint(T_map_base.translation);
  }
}

}  // namespace

MapBuilder BuildNavigationMap(const Map& map, const CameraModel& camera, const MapBuilderOptions& options,
                              const LandmarkAcceptance& acceptance) {
  MapBuilder builder(options);
  if (!map.metric) return builder;
  for (const auto& [id, keyframe] : map.keyframes) {
    builder.InsertPoints(PointsSeenBy(map, keyframe, camera, acceptance));
    builder.MarkFootprint(keyframe.T_map_base.translation.head<2>());
    MarkDrivenLine(map, keyframe, &builder);
  }
  for (const auto& [id, keyframe] : map.keyframes) InsertSweeps(keyframe, &builder);
  return builder;
}

std::vector<CloudPoint> LandmarkCloud(const Map& map) {
  std::vector<CloudPoint> cloud;
  cloud.reserve(map.landmarks.size());
  for (const auto& [id, landmark] : map.landmarks) {
    const Eigen::Vector3d towards = -landmark.view_direction;
    cloud.push_back(
        {landmark.p_map.cast<float>(), towards.cast<float>(), static_cast<float>(landmark.observations.size())});
  }
  return cloud;
}

}  // namespace planar_vslam
