#include "accepted_landmarks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "planar_vslam/geometry/triangulation.h"
#include "planar_vslam/mapping2d/planes.h"

namespace planar_vslam {
namespace {

struct Candidate {
  LandmarkId id;
  Eigen::Vector3d p_map;
  AcceptedLandmark accepted;
  double reprojection = 0.0;  // px RMS, at the keypoints' scales
};

// The keyframes' cameras, composed once.
using Cameras = std::map<KeyframeId, Rigid3>;  // T_map_camera
Cameras CamerasOf(const Map& map) {
  Cameras cameras;
  for (const auto& [id, keyframe] : map.keyframes) cameras.emplace_hint(cameras.end(), id, keyframe.T_map_camera());
  return cameras;
}

// The floor as the landmarks show it; where they show none, z = 0.
FloorPlane FloorOf(const Map& map, const LandmarkAcceptance& acceptance) {
  std::vector<Eigen::Vector3d> points;
  for (const auto& [id, landmark] : map.landmarks) {
    if (static_cast<int>(landmark.observations.size()) >= acceptance.min_observations) points.push_back(landmark.p_map);
  }
  return FindFloor(points, PlaneOptions{}).value_or(FloorPlane{});
}

// px RMS over the observations, each at the scale its keypoint was found at. Infinite for a point behind a camera.
double Reprojection(const Map& map, const Landmark& landmark, const CameraModel& camera, const Cameras& cameras) {
  double sum = 0.0;
  for (const Observation& o : landmark.observations) {
    const Eigen::Vector3d p_camera = cameras.at(o.keyframe).Inverse() * landmark.p_map;
    if (p_camera.z() <= 0.0) return std::numeric_limits<double>::infinity();
    const Keypoint& keypoint = map.keyframes.At(o.keyframe).features->keypoints[o.keypoint];
    const double scale = map.octave_scales[static_cast<std::size_t>(keypoint.octave)];
    const Eigen::Vector2d error = camera.ProjectUndistorted(p_camera) - keypoint.pixel.cast<double>();
    sum += error.squaredNorm() / (scale * scale);
  }
  return std::sqrt(sum / static_cast<double>(landmark.observations.size()));
}

// Depth sigma of a ray intersection: the pixel's angle times distance over the sine of the parallax, the widest angle
// between the first observer's ray and another's.
std::optional<Candidate> Triangulated(LandmarkId id, const Landmark& landmark, const CameraModel& camera,
                                      const Cameras& cameras, const LandmarkAcceptance& a) {
  if (static_cast<int>(landmark.observations.size()) < a.min_observations) return std::nullopt;
  const Eigen::Vector3d first = cameras.at(landmark.observations.front().keyframe).translation;
  double parallax = 0.0, nearest = std::numeric_limits<double>::infinity();
  for (const Observation& o : landmark.observations) {
    const Eigen::Vector3d& center = cameras.at(o.keyframe).translation;
    parallax = std::max(parallax, ParallaxAngle(landmark.p_map, first, center));
    nearest = std::min(nearest, (landmark.p_map - center).norm());
  }
  if (parallax < a.min_parallax) return std::nullopt;
  const double sigma = a.pixel_sigma / camera.fx / std::sin(std::min(parallax, M_PI / 2.0));
  if (sigma > a.max_relative_depth_sigma || sigma * nearest > a.max_depth_sigma) return std::nullopt;
  return Candidate{id, landmark.p_map, {sigma, sigma * nearest, false}};
}

// Of usable depth, no mirror images below the floor, none alone.
std::vector<Candidate> Candidates(const Map& map, const CameraModel& camera, const LandmarkAcceptance& acceptance) {
  const Cameras cameras = CamerasOf(map);
  const FloorPlane floor = FloorOf(map, acceptance);
  std::vector<Candidate> triangulated;
  std::vector<Eigen::Vector3d> positions;
  for (const auto& [id, landmark] : map.landmarks) {
    if (floor.HeightOf(landmark.p_map) < acceptance.min_height) continue;
    std::optional<Candidate> candidate = Triangulated(id, landmark, camera, cameras, acceptance);
    if (!candidate.has_value()) continue;
    triangulated.push_back(*candidate);
    positions.push_back(landmark.p_map);
  }
  std::vector<Candidate> candidates;
  for (const int i : RadiusInliers(positions, acceptance.neighbor_radius, acceptance.min_neighbors)) {
    candidates.push_back(triangulated[static_cast<std::size_t>(i)]);
    Candidate& candidate = candidates.back();
    candidate.reprojection = Reprojection(map, map.landmarks.At(candidate.id), camera, cameras);
  }
  return candidates;
}

// Landmarks above and below one another, found by their place in the plane.
class Upright {
 public:
  explicit Upright(const LandmarkAcceptance& acceptance) : acceptance_(acceptance) {}

  void Add(const Eigen::Vector3d& p) { columns_[ColumnOf(p)].push_back(p); }

  // Whether as many others as asked for lie within the column around `p`, which was added.
  bool Holds(const Eigen::Vector3d& p) const {
    const Column at = ColumnOf(p);
    int others = -1;
    for (long y = at[1] - 1; y <= at[1] + 1; ++y) {
      for (long x = at[0] - 1; x <= at[0] + 1; ++x) {
        const auto column = columns_.find({x, y});
        if (column == columns_.end()) continue;
        others += static_cast<int>(std::count_if(column->second.begin(), column->second.end(), [&](const auto& q) {
          return (q - p).template head<2>().norm() <= acceptance_.upright_radius &&
                 (q - p).norm() <= acceptance_.neighbor_radius;
        }));
      }
    }
    return others >= acceptance_.min_upright;
  }

 private:
  using Column = std::array<long, 2>;
  Column ColumnOf(const Eigen::Vector3d& p) const {
    return {std::lround(p.x() / acceptance_.upright_radius), std::lround(p.y() / acceptance_.upright_radius)};
  }

  const LandmarkAcceptance& acceptance_;
  std::map<Column, std::vector<Eigen::Vector3d>> columns_;
};

}  // namespace

AcceptedLandmarks AcceptLandmarks(const Map& map, const CameraModel& camera, const LandmarkAcceptance& acceptance,
                                  double hit_sigma) {
  std::vector<Candidate> candidates = Candidates(map, camera, acceptance);
  const auto is_sure = [&](const Candidate& c) { return c.accepted.least_sigma <= hit_sigma; };
  Upright upright(acceptance);
  for (const Candidate& c : candidates) {
    if (is_sure(c)) upright.Add(c.p_map);
  }
  AcceptedLandmarks accepted;
  for (Candidate& c : candidates) {
    c.accepted.blocks =
        is_sure(c) && c.reprojection <= acceptance.max_reprojection * acceptance.pixel_sigma && upright.Holds(c.p_map);
    accepted.emplace_hint(accepted.end(), c.id, c.accepted);
  }
  return accepted;
}

}  // namespace planar_vslam
