#include "planar_vslam/pipeline/map_scale.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "planar_vslam/map/map_edit.h"
#include "planar_vslam/planar/floor_points.h"

namespace planar_vslam {
namespace {

double Hypotenuse(double a, double b) { return std::sqrt(a * a + b * b); }

std::optional<ScaleMeasurement> FromLaser(const Map& map, const SystematicErrors& systematic) {
  constexpr double kShortest = 0.1;  // m
  double weights = 0.0, sum = 0.0;
  for (const auto& [id, keyframe] : map.keyframes) {
    for (const MotionLink& link : keyframe.laser_links) {
      const double measured = link.motion.T_i_j.translation.norm();
      const Rigid3 T_i_j = map.keyframes.At(link.from).T_map_base.Inverse() * keyframe.T_map_base;
      if (measured < kShortest || T_i_j.translation.norm() < kShortest) continue;
      const double variance = link.motion.covariance.topLeftCorner<2, 2>().trace() / (measured * measured);
      if (!(variance > 0.0)) continue;
      sum += std::log(measured / T_i_j.translation.norm()) / variance;
      weights += 1.0 / variance;
    }
  }
  if (!(weights > 0.0)) return std::nullopt;
  return ScaleMeasurement{sum / weights, Hypotenuse(systematic.laser, 1.0 / std::sqrt(weights))};
}

// How far parts of the floor are from one level: what was driven, cut in four. Nothing where parts show none.
std::optional<double> Unevenness(const std::vector<Eigen::Vector3d>& points) {
  constexpr std::size_t kParts = 4;
  double sum = 0.0, squares = 0.0;
  for (std::size_t part = 0; part < kParts; ++part) {
    const auto at = [&](std::size_t k) {
      return points.begin() + static_cast<std::ptrdiff_t>(k * points.size() / kParts);
    };
    const FloorPoints floor = FindFloorPoints({at(part), at(part + 1)});
    if (floor.indices.empty()) return std::nullopt;
    sum += floor.level;
    squares += floor.level * floor.level;
  }
  constexpr auto kCount = static_cast<double>(kParts);
  return std::sqrt(std::max(0.0, squares - sum * sum / kCount) / (kCount - 1.0));
}

void AddFloor(const Map& map, const ScaleOptions& options, MapScale* scale) {
  constexpr std::size_t kMinObservations = 3;
  constexpr double kPointSigma = 0.03;  // m, how well one landmark shows the floor
  std::vector<Eigen::Vector3d> points;  // in the order they were made
  for (const auto& [id, landmark] : map.landmarks) {
    if (landmark.observations.size() >= kMinObservations) points.push_back(landmark.p_map);
  }
  const FloorPoints floor = FindFloorPoints(points);
  if (floor.indices.empty()) return;
  const double height = map.keyframes.begin()->second.T_base_camera.translation.z();
  constexpr double kLowest = 0.1;  // m, a camera that sees the floor at a useful angle
  if (height < kLowest) return;
  const std::optional<double> uneven = Unevenness(points);
  const double sigma = Hypotenuse(Hypotenuse(options.height_sigma, uneven.value_or(0.0)),
                                  kPointSigma / std::sqrt(static_cast<double>(floor.indices.size())));
  scale->floor = ScaleMeasurement{floor.level / height, sigma / height};
  scale->floor_in_parts = uneven.has_value();
}

bool Consistent(const std::vector<ScaleMeasurement>& sources) {
  constexpr double kSigmas = 3.0;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double sigma = Hypotenuse(sources[i].sigma, sources[j].sigma);
      if (std::abs(sources[i].log_scale - sources[j].log_scale) > kSigmas * sigma) return false;
    }
  }
  return true;
}

}  // namespace

std::vector<LeverArmSample> LinkedTrack(const Map& map) {
  std::vector<LeverArmSample> samples;
  Rigid2 T_odom_base;
  KeyframeId before;
  for (const auto& [id, keyframe] : map.keyframes) {
    const bool linked =
        !samples.empty() && keyframe.odometry_link.has_value() && keyframe.odometry_link->from == before;
    if (!linked) {
      samples.clear();
      T_odom_base = Rigid2();
    } else {
      T_odom_base = T_odom_base * keyframe.odometry_link->motion.T_i_j;
    }
    samples.push_back({keyframe.T_map_camera(), keyframe.T_base_camera, T_odom_base});
    before = id;
  }
  return samples;
}

MapScale AssessScale(const Map& map, const ScaleOptions& options, const SystematicErrors& systematic) {
  MapScale scale;
  scale.track = EstimateScale(LinkedTrack(map));
  std::vector<ScaleMeasurement> sources;
  if (scale.track.has_value()) {
    scale.wheels = ScaleMeasurement{std::log(scale.track->scale), Hypotenuse(systematic.wheels, scale.track->sigma)};
    sources.push_back(*scale.wheels);
  }
  if (map.metric) {
    scale.laser = FromLaser(map, systematic);
    AddFloor(map, options, &scale);
  } else if (scale.wheels.has_value()) {
    AddFloor(ScaledToMetric(map, scale.track->scale), options, &scale);
    if (scale.floor.has_value()) scale.floor->log_scale += scale.wheels->log_scale;
  }
  for (const auto& source : {scale.laser, scale.floor}) {
    if (source.has_value()) sources.push_back(*source);
  }
  scale.consistent = Consistent(sources);
  scale.fused = Fuse(sources);
  return scale;
}

Map ScaledToMetric(const Map& map, double scale) {
  const Keyframe& first = map.keyframes.begin()->second;
  Rigid3 T_map_camera = first.T_map_camera();
  T_map_camera.translation *= scale;
  const Rigid3 T_level = (T_map_camera * first.T_base_camera.Inverse()).Inverse();
  return Apply(map, {TransformMap{scale, T_level}, SetMetric{true}});
}

std::string ScaleGate::Missing(const MapScale& scale, const ScaleOptions& options) {
  if (!scale.track.has_value()) return "scale: drive on, sideways or forwards";
  constexpr std::size_t kRecent = 4;  // the newest and three before
  constexpr int kMinPairs = 8;
  recent_.push_back(scale.fused->log_scale);
  if (recent_.size() > kRecent) recent_.erase(recent_.begin());
  const ScaleEstimate& track = *scale.track;
  if (track.distance < options.min_distance) {
    return fmt::format("scale: drive {:.1f} m more", options.min_distance - track.distance);
  }
  if (scale.fused->sigma > options.max_sigma) {
    // What is random falls with the way driven.
    const double more = track.distance * (std::pow(scale.fused->sigma / options.max_sigma, 2.0) - 1.0);
    return fmt::format("scale known to {:.1f} %, {:.1f} % wanted: drive {:.1f} m more, sideways if you can",
                       100.0 * scale.fused->sigma, 100.0 * options.max_sigma, std::min(more, 9.9));
  }
  const auto [low, high] = std::minmax_element(recent_.begin(), recent_.end());
  if (recent_.size() < kRecent || *high - *low > options.max_sigma || track.pairs < kMinPairs) {
    return "scale: a few more views, it still changes";
  }
  if (!scale.consistent)
    return "scale: wheels and the floor's distance disagree; drive on without slip, check the mount";
  return "";
}

}  // namespace planar_vslam
