#include "wheel_comparison.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

namespace planar_vslam {
namespace {

Rigid2 MotionInMap(const Map& map, KeyframeId i, const Keyframe& j) {
  return ProjectToPlane(map.keyframes.At(i).T_map_base).Inverse() * ProjectToPlane(j.T_map_base);
}

// Landmarks that `j` and the keyframe `i` before it see: how many, and the sum of their inverse squared depths, 1/m^2.
struct SharedLandmarks {
  int count = 0;
  double inverse_squares = 0.0;
};

SharedLandmarks SharedBy(const Map& map, KeyframeId i, const Keyframe& j) {
  constexpr double kNearest = 0.1;  // m
  const Rigid3 T_camera_map = j.T_map_camera().Inverse();
  SharedLandmarks shared;
  for (const LandmarkId id : j.landmarks) {
    if (!id.valid()) continue;
    const Landmark& landmark = map.landmarks.At(id);
    const std::vector<Observation>& seen = landmark.observations;
    const auto at = std::lower_bound(seen.begin(), seen.end(), i,
                                     [](const Observation& o, KeyframeId k) { return o.keyframe < k; });
    if (at == seen.end() || at->keyframe != i) continue;
    const double z = (T_camera_map * landmark.p_map).z();
    if (z <= 0.0) continue;
    const double depth = std::max(kNearest, z);
    ++shared.count;
    shared.inverse_squares += 1.0 / (depth * depth);
  }
  return shared;
}

double Square(double value) { return value * value; }

// A link between keyframes that see enough of the same: images say how the robot moved, not the wheels.
void CompareInMap(const Map& map, const Keyframe& keyframe, const MeasurementModel& model, WheelComparisons* all) {
  constexpr int kMinShared = 20;     // landmarks
  constexpr double kTogether = 6.0;  // their errors are not independent: as map_ties.h counts them
  const MotionLink& link = *keyframe.odometry_link;
  const SharedLandmarks shared = SharedBy(map, link.from, keyframe);
  if (shared.count < kMinShared) return;
  const Rigid2 in_map = MotionInMap(map, link.from, keyframe);
  const Eigen::Matrix3d floor = CovarianceWithFloor(PlanarMotion{}, model.odometry_noise);
  TurnComparison turn;
  turn.off(0) = WrapAngle(in_map.angle - link.motion.T_i_j.angle);
  turn.best(0) = link.motion.T_i_j.angle + turn.off(0);
  turn.of_wheels(0) = link.motion.covariance(2, 2);
  turn.of_rest(0) = floor(2, 2) + 2.0 * Square(model.odometry_noise.tilt_floor);  // the camera sways at both ends
  all->turns.push_back(turn);
  const double of_images = Square(kTogether * model.pixel_sigma / model.camera.fx) / shared.inverse_squares;
  WayComparison way;
  way.off = in_map.translation - link.motion.T_i_j.translation;
  way.best = in_map.translation;
  way.of_wheels = link.motion.covariance.topLeftCorner<2, 2>();
  way.of_rest = floor.topLeftCorner<2, 2>() + of_images * Eigen::Matrix2d::Identity();
  all->ways_in_map.push_back(way);
}

// By the wheels from `from` to `id`, where few enough links lead there.
std::optional<PlanarMotion> ByWheels(const Map& map, KeyframeId from, KeyframeId id) {
  constexpr int kFarthest = 8;  // links
  std::optional<PlanarMotion> motion;
  for (int links = 0; links < kFarthest && from < id; ++links) {
    const Keyframe* keyframe = map.keyframes.Find(id);
    if (keyframe == nullptr || !keyframe->odometry_link.has_value()) return std::nullopt;
    const MotionLink& link = *keyframe->odometry_link;
    motion = motion.has_value() ? Compose(link.motion, *motion) : link.motion;
    id = link.from;
  }
  return id == from ? motion : std::nullopt;
}

std::optional<WayComparison> CompareWithLaser(const Map& map, KeyframeId id, const MotionLink& laser,
                                              const MeasurementModel& model) {
  const std::optional<PlanarMotion> wheels = ByWheels(map, laser.from, id);
  if (!wheels.has_value()) return std::nullopt;
  const Eigen::Matrix3d floor = CovarianceWithFloor(PlanarMotion{}, model.odometry_noise);
  WayComparison way;
  way.off = laser.motion.T_i_j.translation - wheels->T_i_j.translation;
  way.of_wheels = wheels->covariance.topLeftCorner<2, 2>();
  way.of_rest = (floor + CovarianceWithFloor(laser.motion, model.laser_floor)).topLeftCorner<2, 2>();
  const Eigen::Matrix2d of_wheels = way.of_wheels + floor.topLeftCorner<2, 2>();
  way.best = wheels->T_i_j.translation + of_wheels * (way.of_wheels + way.of_rest).llt().solve(way.off);
  return way;
}

}  // namespace

WheelComparisons CompareWheels(const Map& map, KeyframeId first, const MeasurementModel& model) {
  WheelComparisons all;
  for (auto it = map.keyframes.From(first); it != map.keyframes.end(); ++it) {
    const auto& [id, keyframe] = *it;
    if (keyframe.odometry_link.has_value() && map.keyframes.Contains(keyframe.odometry_link->from)) {
      CompareInMap(map, keyframe, model, &all);
    }
    for (const MotionLink& laser : keyframe.laser_links) {
      if (laser.from < first) continue;
      const std::optional<WayComparison> way = CompareWithLaser(map, id, laser, model);
      if (way.has_value()) all.ways_by_laser.push_back(*way);
    }
  }
  return all;
}

}  // namespace planar_vslam
