#include "planar_vslam/pipeline/wheel_errors.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "wheel_comparison.h"

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

// `times`: that the same part of the drive is compared.
template <int N>
std::vector<Share> SharesOf(const std::vector<WheelComparison<N>>& comparisons, double factor, double times) {
  std::vector<Share> shares;
  for (const WheelComparison<N>& c : comparisons) {
    const auto weight = Eigen::LLT<typename WheelComparison<N>::Matrix>(
        typename WheelComparison<N>::Matrix(times * (factor * factor * c.of_wheels + c.of_rest)));
    const auto of = weight.matrixL().solve(c.best).eval(), off = weight.matrixL().solve(c.off).eval();
    shares.push_back({of.dot(off), of.squaredNorm(), off.squaredNorm()});
  }
  return shares;
}

template <int N>
double MedianMisfit(const std::vector<WheelComparison<N>>& comparisons, double share, double factor) {
  std::vector<double> misfits;
  misfits.reserve(comparisons.size());
  for (const Share& s : SharesOf(comparisons, factor, 1.0)) misfits.push_back(Misfit(s, share));
  const auto middle = misfits.begin() + static_cast<std::ptrdiff_t>(misfits.size() / 2);
  std::nth_element(misfits.begin(), middle, misfits.end());
  return *middle;
}

// The noise in whole: that applied, `applied`, times what the comparisons show beyond it.
template <int N>
double NoiseOf(const std::vector<WheelComparison<N>>& comparisons, double share, double applied) {
  constexpr double kMost = 6.0;    // beyond that it is no noise, but wheels that are broken
  constexpr double kPrior = 20.0;  // links that what was configured is worth, 4 m of driving: chosen, not fitted
  constexpr double kMedian = N == 1 ? 0.4549 : 1.3863;  // of chi-square
  constexpr int kHalvings = 12;
  if (comparisons.empty()) return applied;
  double low = 1.0 / applied, high = kMost / applied;
  if (MedianMisfit(comparisons, share, low) <= kMedian) return 1.0;
  for (int k = 0; k < kHalvings; ++k) {
    const double middle = std::sqrt(low * high);
    (MedianMisfit(comparisons, share, middle) > kMedian ? low : high) = middle;
  }
  const auto count = static_cast<double>(comparisons.size());
  return std::pow(applied * std::sqrt(low * high), count / (count + kPrior));
}

Share ShareOf(const ScaleMeasurement& scale) {
  const double information = 1.0 / (scale.sigma * scale.sigma), off = scale.log_scale;
  return {information * off, information, information * off * off};
}

bool IsOther(double now, double applied) {
  constexpr double kShare = 0.1;
  return std::abs(now - applied) > kShare * applied;
}

}  // namespace

WheelErrors UnknownWheelErrors(const SystematicErrors& systematic) {
  return {0.0, 0.0, systematic.wheels, systematic.turn, {}};
}

WheelErrors LearnWheelErrors(const Map& map, KeyframeId first, const WheelErrors& prior, const WheelErrors& applied,
                             const std::optional<ScaleMeasurement>& floor, const MeasurementModel& model) {
  constexpr double kTimes = 2.0;  // a laser link over several keyframes and the ones between them tell of the same way
  const WheelComparisons compared = CompareWheels(map, first, model);
  std::vector<Share> lengths = SharesOf(compared.ways_by_laser, 1.0, kTimes);
  if (lengths.empty() && floor.has_value()) lengths.push_back(ShareOf(*floor));
  const Gaussian length = Fuse(lengths, {prior.log_length - applied.log_length, prior.length_sigma}, 2.0);
  const Gaussian turn =
      Fuse(SharesOf(compared.turns, 1.0, 1.0), {prior.log_turn - applied.log_turn, prior.turn_sigma}, 1.0);
  const bool by_laser = !compared.ways_by_laser.empty();
  const std::vector<WayComparison>& ways = by_laser ? compared.ways_by_laser : compared.ways_in_map;
  return {applied.log_length + length.mean,
          applied.log_turn + turn.mean,
          length.sigma,
          turn.sigma,
          {NoiseOf(ways, by_laser ? length.mean : 0.0, applied.noise.way),
           NoiseOf(compared.turns, turn.mean, applied.noise.turn)}};
}

bool IsNews(const WheelErrors& now, const WheelErrors& applied) {
  constexpr double kShare = 0.5;  // of a standard deviation
  return std::abs(now.log_length - applied.log_length) > kShare * now.length_sigma ||
         std::abs(now.log_turn - applied.log_turn) > kShare * now.turn_sigma ||
         IsOther(now.noise.way, applied.noise.way) || IsOther(now.noise.turn, applied.noise.turn);
}

}  // namespace planar_vslam
