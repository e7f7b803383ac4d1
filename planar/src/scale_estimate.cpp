#include "planar_vslam/planar/scale_estimate.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "planar_vslam/geometry/median.h"

namespace planar_vslam {
namespace {

constexpr double kMinDistance = 0.3;                 // m of driving, below which nothing is said
constexpr std::array<int, 4> kGaps = {3, 5, 8, 12};  // keyframes
constexpr double kShortestGap = 0.3;                 // m

// The base over the keyframes, by vision at some scale and by the wheels.
struct Track {
  std::vector<Eigen::Vector3d> visual;
  std::vector<Rigid2> odometry;
  std::vector<double> turn_difference;  // rad, per step
};

Eigen::Quaterniond BaseRotation(const LeverArmSample& sample) {
  return sample.T_map_camera.rotation * sample.T_base_camera.rotation.conjugate();
}

Track AtScale(const std::vector<LeverArmSample>& samples, double scale) {
  Track track;
  for (const LeverArmSample& sample : samples) {
    const Eigen::Vector3d lever = BaseRotation(sample) * sample.T_base_camera.translation;
    track.visual.emplace_back(scale * sample.T_map_camera.translation - lever);
    track.odometry.push_back(sample.T_odom_base);
  }
  for (std::size_t k = 1; k < samples.size(); ++k) {
    const double visual = LogSo3(BaseRotation(samples[k - 1]).conjugate() * BaseRotation(samples[k])).norm();
    const double wheels = std::abs(WrapAngle(samples[k].T_odom_base.angle - samples[k - 1].T_odom_base.angle));
    track.turn_difference.push_back(std::abs(visual - wheels));
  }
  return track;
}

double WayByWheels(const Track& track, std::size_t i, std::size_t j) {
  return (track.odometry[j].translation - track.odometry[i].translation).norm();
}

double WayByVision(const Track& track, std::size_t i, std::size_t j) {
  return (track.visual[j] - track.visual[i]).norm();
}

// Per step between keyframes, whether wheels and vision disagree about it.
std::vector<bool> SlippedSteps(const Track& track) {
  constexpr double kLimit = 4.0;         // of the steps' own scatter
  constexpr double kShare = 0.08;        // of the step: below it is noise of the wheels
  constexpr double kLeastLength = 0.02;  // m
  constexpr double kLeastTurn = 0.03;    // rad
  const std::size_t steps = track.turn_difference.size();
  std::vector<double> scatter;
  for (std::size_t k = 0; k < steps; ++k) {
    scatter.push_back(std::abs(WayByVision(track, k, k + 1) - WayByWheels(track, k, k + 1)));
  }
  constexpr double kSigmaOfMedian = 1.4826;
  const double length_sigma = kSigmaOfMedian * Median(scatter);
  const double turn_sigma = kSigmaOfMedian * Median(track.turn_difference);
  std::vector<bool> slipped(steps);
  for (std::size_t k = 0; k < steps; ++k) {
    const double share = kShare * WayByWheels(track, k, k + 1);
    slipped[k] = scatter[k] > std::max({kLimit * length_sigma, 2.5 * share, kLeastLength}) ||
                 track.turn_difference[k] > std::max(kLimit * turn_sigma, kLeastTurn);
  }
  return slipped;
}

// A scale that a few slips do not bend: of single steps, only those that slipped are wrong.
double MedianStepRatio(const Track& track) {
  constexpr double kLongStep = 0.1;  // m
  constexpr std::size_t kMinSteps = 5;
  std::vector<double> ratios;
  for (std::size_t k = 0; k + 1 < track.visual.size(); ++k) {
    const double a = WayByWheels(track, k, k + 1), b = WayByVision(track, k, k + 1);
    if (a > kLongStep && b > 0.0) ratios.push_back(std::log(a / b));
  }
  return ratios.size() < kMinSteps ? 0.0 : Median(ratios);
}

struct GapRatio {
  double way = 0.0;        // a
  double log_ratio = 0.0;  // log(a / b)
  double weight = 0.0;
};

// Pairs of keyframes of the gaps without a slipped step between them.
std::vector<GapRatio> Ratios(const Track& track, const std::vector<bool>& slipped) {
  constexpr double kOdometryShare = 0.03, kVisualSigma = 0.02;  // m, per position: relative weights of short and long
  std::vector<GapRatio> ratios;
  for (const int gap : kGaps) {
    for (std::size_t i = 0; i + static_cast<std::size_t>(gap) < track.visual.size(); ++i) {
      const std::size_t j = i + static_cast<std::size_t>(gap);
      const auto begin = slipped.begin() + static_cast<std::ptrdiff_t>(i);
      if (std::find(begin, begin + gap, true) != begin + gap) continue;
      const double a = WayByWheels(track, i, j), b = WayByVision(track, i, j);
      if (a < kShortestGap || b < kShortestGap) continue;
      const double visual = kVisualSigma / b;
      ratios.push_back({a, std::log(a / b), 1.0 / ((kOdometryShare * kOdometryShare + 2.0 * visual * visual) * gap)});
    }
  }
  return ratios;
}

// Weighted mean under Cauchy weights around a weighted start.
double RobustMean(const std::vector<GapRatio>& ratios) {
  constexpr double kCauchy = 0.05;
  constexpr int kRounds = 10;
  std::vector<double> values;
  for (const GapRatio& r : ratios) values.push_back(r.log_ratio);
  double mean = Median(values);
  for (int round = 0; round < kRounds; ++round) {
    double sum = 0.0, weights = 0.0;
    for (const GapRatio& r : ratios) {
      const double e = (r.log_ratio - mean) / kCauchy;
      const double weight = r.weight / (1.0 + e * e);
      sum += weight * r.log_ratio;
      weights += weight;
    }
    mean = sum / weights;
  }
  return mean;
}

// Over pieces of the track without slips: var(r) = 2 sigma_v^2 + rho^2 a, by least squares over gaps.
struct Scatter {
  double visual_variance = 0.0;  // 2 sigma_v^2, m^2
  double rate = 0.0;             // rho^2, m
};
Scatter MeasureScatter(const Track& track, const std::vector<bool>& slipped) {
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  for (const int gap : {1, 2, 4, 8}) {
    for (std::size_t i = 0; i + static_cast<std::size_t>(gap) < track.visual.size(); ++i) {
      const std::size_t j = i + static_cast<std::size_t>(gap);
      const auto begin = slipped.begin() + static_cast<std::ptrdiff_t>(i);
      if (std::find(begin, begin + gap, true) != begin + gap) continue;
      const double a = WayByWheels(track, i, j), r = WayByVision(track, i, j) - a;
      const Eigen::Vector2d row(1.0, a);
      normal += row * row.transpose() / gap;
      right += row * r * r / gap;
    }
  }
  constexpr double kLeastRate = 0.002 * 0.002;  // m: no wheels are better than 0.2 % over a metre
  const Eigen::Vector2d both = (normal + 1e-9 * Eigen::Matrix2d::Identity()).ldlt().solve(right);
  Scatter scatter{both[0], both[1]};
  if (scatter.visual_variance < 0.0) scatter = {0.0, right[1] / normal(1, 1)};
  if (scatter.rate < 0.0) scatter = {right[0] / normal(0, 0), 0.0};
  scatter.rate = std::max(scatter.rate, kLeastRate);
  return scatter;
}

// Over gaps of a mean way b: each tells 2 sigma_v^2 / b^2, and there are D / b of them that share nothing.
double SigmaByGaps(const Scatter& scatter, const std::vector<GapRatio>& ratios, double distance) {
  double way = 0.0, weights = 0.0;
  for (const GapRatio& r : ratios) {
    way += r.weight * r.way;
    weights += r.weight;
  }
  way = weights > 0.0 ? way / weights : distance;
  constexpr double kOverlap = 1.3;  // fitted: what overlapping gaps lose against one sum over the whole way
  return std::sqrt(kOverlap * (scatter.rate / distance + scatter.visual_variance / (distance * way)));
}

// A winding track spreads less than its length: with the mean square V of the distance from the centroid (D^2 / 12 on a
// straight one), sigma^2 = 1.2 rho^2 D / (12 V) + sigma_v^2 / (N V).
double SigmaByCentroids(const Scatter& scatter, const Track& track, double distance) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  const auto count = static_cast<double>(track.visual.size());
  for (const Eigen::Vector3d& p : track.visual) mean += p / count;
  double spread = 0.0;
  for (const Eigen::Vector3d& p : track.visual) spread += (p - mean).squaredNorm() / count;
  return std::sqrt(0.1 * scatter.rate * distance / spread + 0.5 * scatter.visual_variance / (count * spread));
}

}  // namespace

std::optional<ScaleEstimate> EstimateScale(const std::vector<LeverArmSample>& samples) {
  const std::optional<double> first = RecoverScale(samples, ScaleMethod::kCentroids, kMinDistance);
  if (!first.has_value()) return std::nullopt;
  ScaleEstimate estimate;
  estimate.scale = *first * std::exp(MedianStepRatio(AtScale(samples, *first)));
  Track track = AtScale(samples, estimate.scale);
  std::vector<bool> slipped = SlippedSteps(track);
  std::vector<GapRatio> ratios = Ratios(track, slipped);
  estimate.slipped = static_cast<int>(std::count(slipped.begin(), slipped.end(), true));
  constexpr std::size_t kLongTrack = 40;  // keyframes: by then the heading of odometry has turned away
  const bool by_gaps = !ratios.empty() && (estimate.slipped > 0 || samples.size() > kLongTrack);
  estimate.scale = by_gaps ? estimate.scale * std::exp(RobustMean(ratios)) : *first;
  track = AtScale(samples, estimate.scale);
  slipped = SlippedSteps(track);
  ratios = Ratios(track, slipped);
  estimate.pairs = static_cast<int>(ratios.size());
  for (std::size_t k = 0; k < slipped.size(); ++k) {
    if (!slipped[k]) estimate.distance += WayByWheels(track, k, k + 1);
  }
  if (estimate.distance < kMinDistance) return std::nullopt;
  const Scatter scatter = MeasureScatter(track, slipped);
  estimate.sigma =
      by_gaps ? SigmaByGaps(scatter, ratios, estimate.distance) : SigmaByCentroids(scatter, track, estimate.distance);
  return estimate;
}

std::optional<ScaleMeasurement> Fuse(const std::vector<ScaleMeasurement>& sources) {
  if (sources.empty()) return std::nullopt;
  double weights = 0.0, sum = 0.0;
  for (const ScaleMeasurement& source : sources) {
    const double weight = 1.0 / (source.sigma * source.sigma);
    weights += weight;
    sum += weight * source.log_scale;
  }
  return ScaleMeasurement{sum / weights, 1.0 / std::sqrt(weights)};
}

}  // namespace planar_vslam
