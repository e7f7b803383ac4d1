#include "planar_vslam/pipeline/wheel_errors.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace planar_vslam {
namespace {

// One link's word: a share x, observed as y = x a + noise of the given information.
struct Share {
  double product;      // a^T W y
  double information;  // a^T W a
  double square;       // y^T W y
};

// N(mean, sigma^2) of a share.
struct Gaussian {
  double mean, sigma;
};

double Misfit(const Share& s, double x) { return s.square - 2.0 * x * s.product + x * x * s.information; }

// `degrees`: of freedom of each share's observation.
Gaussian Fuse(const std::vector<Share>& shares, const Gaussian& prior, double degrees) {
  constexpr double kSigmas = 3.0;
  constexpr int kRounds = 3;  // with those left out that do not agree with the round before
  const double known = 1.0 / (prior.sigma * prior.sigma);
  Gaussian posterior = prior;
  for (int round = 0; round < kRounds; ++round) {
    double sum = known * prior.mean, information = known;
    for (const Share& share : shares) {
      if (round > 0 && Misfit(share, posterior.mean) > kSigmas * kSigmas * degrees) continue;
      sum += share.product;
      information += share.information;
    }
    posterior = {sum / information, 1.0 / std::sqrt(information)};
  }
  return posterior;
}

Rigid2 MotionInMap(const Map& map, KeyframeId i, const Keyframe& j) {
  return ProjectToPlane(map.keyframes.At(i).T_map_base).Inverse() * ProjectToPlane(j.T_map_base);
}

int SharedLandmarks(const Map& map, KeyframeId i, const Keyframe& j) {
  int shared = 0;
  for (const LandmarkId id : j.landmarks) {
    if (!id.valid()) continue;
    const std::vector<Observation>& seen = map.landmarks.At(id).observations;
    const auto at = std::lower_bound(seen.begin(), seen.end(), i,
                                     [](const Observation& o, KeyframeId k) { return o.keyframe < k; });
    shared += at != seen.end() && at->keyframe == i ? 1 : 0;
  }
  return shared;
}

std::vector<Share> TurnShares(const Map& map, KeyframeId first, const MeasurementModel& model) {
  constexpr int kMinShared = 20;  // landmarks: images say how far the robot turned, not the wheels
  std::vector<Share> shares;
  const double sway = std::sqrt(2.0) * model.odometry_noise.tilt_floor;  // of the camera, at both ends
  for (auto it = map.keyframes.From(first); it != map.keyframes.end(); ++it) {
    const auto& [id, keyframe] = *it;
    if (!keyframe.odometry_link.has_value()) continue;
    const MotionLink& link = *keyframe.odometry_link;
    if (!map.keyframes.Contains(link.from) || SharedLandmarks(map, link.from, keyframe) < kMinShared) continue;
    const double turn = link.motion.T_i_j.angle;
    const double off = WrapAngle(MotionInMap(map, link.from, keyframe).angle - turn);
    const double variance = CovarianceWithFloor(link.motion, model.odometry_noise)(2, 2) + sway * sway;
    shares.push_back({turn * off / variance, turn * turn / variance, off * off / variance});
  }
  return shares;
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

std::vector<Share> LengthShares(const Map& map, KeyframeId first, const MeasurementModel& model) {
  std::vector<Share> shares;
  for (auto it = map.keyframes.From(first); it != map.keyframes.end(); ++it) {
    const auto& [id, keyframe] = *it;
    for (const MotionLink& laser : keyframe.laser_links) {
      if (laser.from < first) continue;
      const std::optional<PlanarMotion> wheels = ByWheels(map, laser.from, id);
      if (!wheels.has_value()) continue;
      const Eigen::Vector2d way = wheels->T_i_j.translation, off = laser.motion.T_i_j.translation - way;
      // A laser link over several keyframes and the ones between them tell of the same way of the wheels.
      constexpr double kShared = 2.0;
      const Eigen::Matrix3d covariance = kShared * (CovarianceWithFloor(laser.motion, model.laser_floor) +
                                                    CovarianceWithFloor(*wheels, model.odometry_noise));
      const Eigen::LLT<Eigen::Matrix2d> weight(Eigen::Matrix2d(covariance.topLeftCorner<2, 2>()));
      const Eigen::Vector2d way_w = weight.matrixL().solve(way), off_w = weight.matrixL().solve(off);
      shares.push_back({way_w.dot(off_w), way_w.squaredNorm(), off_w.squaredNorm()});
    }
  }
  return shares;
}

Share ShareOf(const ScaleMeasurement& scale) {
  const double information = 1.0 / (scale.sigma * scale.sigma), off = scale.log_scale;
  return {information * off, information, information * off * off};
}

}  // namespace

WheelErrors UnknownWheelErrors(const SystematicErrors& systematic) {
  return {0.0, 0.0, systematic.wheels, systematic.turn};
}

WheelErrors LearnWheelErrors(const Map& map, KeyframeId first, const WheelErrors& prior, const WheelErrors& applied,
                             const std::optional<ScaleMeasurement>& floor, const MeasurementModel& model) {
  std::vector<Share> lengths = LengthShares(map, first, model);
  if (lengths.empty() && floor.has_value()) lengths.push_back(ShareOf(*floor));
  const Gaussian length = Fuse(lengths, {prior.log_length - applied.log_length, prior.length_sigma}, 2.0);
  const Gaussian turn = Fuse(TurnShares(map, first, model), {prior.log_turn - applied.log_turn, prior.turn_sigma}, 1.0);
  return {applied.log_length + length.mean, applied.log_turn + turn.mean, length.sigma, turn.sigma};
}

bool IsNews(const WheelErrors& now, const WheelErrors& applied) {
  constexpr double kShare = 0.5;  // of a standard deviation
  return std::abs(now.log_length - applied.log_length) > kShare * now.length_sigma ||
         std::abs(now.log_turn - applied.log_turn) > kShare * now.turn_sigma;
}

}  // namespace planar_vslam
