#include "planar_vslam/pipeline/map_planes.h"

#include <fmt/format.h>

namespace planar_vslam {

MapPlanes PlanesOf(const Map& map, const PlaneOptions& options) {
  constexpr std::size_t kMinObservations = 3;
  if (!map.metric) return {};
  std::vector<Eigen::Vector3d> points;
  for (const auto& [id, landmark] : map.landmarks) {
    if (landmark.observations.size() >= kMinObservations) points.push_back(landmark.p_map);
  }
  return {FindFloor(points, options), FindWalls(points, options)};
}

std::string FloorText(const std::optional<FloorPlane>& floor) {
  if (!floor.has_value()) return "no floor seen";
  return fmt::format("{:+.3f} m from z = 0, tilted by {:.2f} deg; {} points, {:.3f} m RMS", floor->height,
                     floor->TiltDegrees(), floor->points, floor->rms);
}

}  // namespace planar_vslam
