#include "planar_vslam/io/evaluation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "evaluation_pairs.h"
#include "stamp_text.h"

namespace planar_vslam {
namespace {

using io::PosePair;

constexpr double kSegmentMeters = 1.0;
constexpr double kSegmentSeconds = 1.0;
constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

ErrorStatistics Statistics(std::vector<double> errors) {
  ErrorStatistics statistics;
  const auto count = static_cast<double>(errors.size());
  for (const double error : errors) {
    statistics.rmse += error * error / count;
    statistics.mean += error / count;
    statistics.max = std::max(statistics.max, error);
  }
  statistics.rmse = std::sqrt(statistics.rmse);
  std::sort(errors.begin(), errors.end());
  const std::size_t middle = errors.size() / 2;
  statistics.median = errors.size() % 2 == 1 ? errors[middle] : 0.5 * (errors[middle - 1] + errors[middle]);
  return statistics;
}

Similarity3 Align(const std::vector<PosePair>& pairs, EvaluationAlignment alignment) {
  if (alignment == EvaluationAlignment::kFirst) {
    return {1.0, pairs.front().truth * pairs.front().estimate.Inverse()};
  }
  Alignment method = Alignment::kNone;
  if (alignment == EvaluationAlignment::kSe2) method = Alignment::kSe2;
  if (alignment == EvaluationAlignment::kSe3) method = Alignment::kSe3;
  if (alignment == EvaluationAlignment::kSim3) method = Alignment::kSim3;
  return AlignPoints(io::EstimatePositions(pairs), io::TruthPositions(pairs), method);
}

void SetAbsoluteErrors(const std::vector<PosePair>& pairs, TrajectoryErrors* errors) {
  std::vector<double> spatial, planar, heading;
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  const Eigen::Quaterniond& turn = errors->truth_from_estimate.T_target_source.rotation;
  for (const PosePair& pair : pairs) {
    const Eigen::Vector3d error = errors->truth_from_estimate.Apply(pair.estimate.translation) - pair.truth.translation;
    spatial.push_back(error.norm());
    planar.push_back(error.head<2>().norm());
    squares += error.cwiseAbs2();
    const Rigid3 turned(turn * pair.estimate.rotation, Eigen::Vector3d::Zero());
    heading.push_back(std::abs(WrapAngle(ProjectToPlane(turned).angle - ProjectToPlane(pair.truth).angle)));
  }
  errors->ate = Statistics(std::move(spatial));
  errors->ate_2d = Statistics(std::move(planar));
  errors->heading = Statistics(std::move(heading));
  errors->ate_axis_rmse = (squares / static_cast<double>(pairs.size())).cwiseSqrt();
}

struct RelativeErrors {
  double translation = kNotMeasured, rotation = kNotMeasured;
};

// RMSE over the shortest segments of at least `length` that start at each pair, measured along `position` (metres or
// seconds since the first pair, increasing); each segment's error is divided by its own length.
RelativeErrors SegmentErrors(const std::vector<PosePair>& pairs, const std::vector<double>& position, double length,
                             double scale) {
  double translation = 0.0, rotation = 0.0;
  long segments = 0;
  std::size_t end = 0;
  for (std::size_t start = 0; start < pairs.size(); ++start) {
    while (end < pairs.size() && position[end] - position[start] < length) ++end;
    if (end == pairs.size()) break;
    if (pairs[start].stretch != pairs[end].stretch) continue;
    const double measured = position[end] - position[start];
    const Rigid3 truth = pairs[start].truth.Inverse() * pairs[end].truth;
    Rigid3 estimate = pairs[start].estimate.Inverse() * pairs[end].estimate;
    estimate.translation *= scale;
    const Rigid3 error = truth.Inverse() * estimate;
    translation += std::pow(error.translation.norm() / measured, 2);
    rotation += std::pow(LogSo3(error.rotation).norm() / measured, 2);
    ++segments;
  }
  if (segments == 0) return {};
  const auto count = static_cast<double>(segments);
  return {std::sqrt(translation / count), std::sqrt(rotation / count)};
}

void SetRelativeErrors(const std::vector<PosePair>& pairs, TrajectoryErrors* errors) {
  // Less than a second, so that jitter of the stamps does not make segments of ten 0.1 s frames one frame longer.
  // Seconds.
  constexpr double kStampSlack = 1e-6;
  std::vector<double> meters{0.0}, seconds{0.0};
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    meters.push_back(meters.back() + (pairs[i].truth.translation - pairs[i - 1].truth.translation).norm());
    seconds.push_back(SecondsBetween(pairs.front().stamp, pairs[i].stamp));
  }
  const double scale = errors->truth_from_estimate.scale;
  const RelativeErrors per_meter = SegmentErrors(pairs, meters, kSegmentMeters, scale);
  const RelativeErrors per_second = SegmentErrors(pairs, seconds, kSegmentSeconds - kStampSlack, scale);
  errors->rpe_translation_per_meter = per_meter.translation;
  errors->rpe_rotation_per_meter = per_meter.rotation;
  errors->rpe_translation_per_second = per_second.translation;
  errors->rpe_rotation_per_second = per_second.rotation;
}

double ScaleError(const std::vector<PosePair>& pairs) {
  const double truth_per_estimate =
      AlignPoints(io::EstimatePositions(pairs), io::TruthPositions(pairs), Alignment::kSim3).scale;
  const bool usable = std::isfinite(truth_per_estimate) && truth_per_estimate > 0.0;
  return usable ? 1.0 / truth_per_estimate - 1.0 : kNotMeasured;
}

std::string Span(const Trajectory& trajectory) {
  if (trajectory.empty()) return "no poses";
  return fmt::format("{} to {} s", io::FormatStamp(trajectory.front().stamp), io::FormatStamp(trajectory.back().stamp));
}

// `align` gives the alignment of the pairs.
template <class Align>
Expected<TrajectoryErrors> Evaluate(const Trajectory& estimate, const Trajectory& truth, const Align& align) {
  const std::vector<PosePair> pairs = io::PairByStamp(estimate, truth);
  constexpr std::size_t kFewestPairs = 3;
  if (pairs.size() < kFewestPairs) {
    return Error{
        fmt::format("{} of {} estimate poses have truth around their stamp; expected at least {} "
                    "(estimate: {}; truth: {})",
                    pairs.size(), estimate.size(), kFewestPairs, Span(estimate), Span(truth))};
  }
  TrajectoryErrors errors;
  errors.pairs = static_cast<long>(pairs.size());
  errors.truth_from_estimate = align(pairs);
  SetAbsoluteErrors(pairs, &errors);
  SetRelativeErrors(pairs, &errors);
  errors.scale_error = ScaleError(pairs);
  errors.coverage = io::Coverage(estimate, truth);
  return errors;
}

}  // namespace

Expected<TrajectoryErrors> EvaluateTrajectory(const Trajectory& estimate, const Trajectory& truth,
                                              EvaluationAlignment alignment) {
  return Evaluate(estimate, truth, [alignment](const std::vector<PosePair>& pairs) { return Align(pairs, alignment); });
}

Expected<TrajectoryErrors> EvaluateTrajectory(const Trajectory& estimate, const Trajectory& truth,
                                              const Similarity3& truth_from_estimate) {
  return Evaluate(estimate, truth, [&](const std::vector<PosePair>&) { return truth_from_estimate; });
}

}  // namespace planar_vslam
