#include "evaluation_pairs.h"

#include <algorithm>

namespace planar_vslam::io {

std::vector<PosePair> PairByStamp(const Trajectory& estimate, const Trajectory& truth) {
  std::vector<PosePair> pairs;
  std::size_t after = 0;  // first truth pose not before the estimate's stamp
  long stretch = 0;
  for (const StampedPose& pose : estimate) {
    for (; after < truth.size() && truth[after].stamp < pose.stamp; ++after) {
      if (after > 0 && SecondsBetween(truth[after - 1].stamp, truth[after].stamp) > kLongestGapSeconds) ++stretch;
    }
    if (after == truth.size()) break;
    if (truth[after].stamp == pose.stamp) {
      const bool gap_before = after > 0 && SecondsBetween(truth[after - 1].stamp, pose.stamp) > kLongestGapSeconds;
      pairs.push_back({pose.stamp, pose.T_map_base, truth[after].T_map_base, stretch + (gap_before ? 1 : 0)});
      continue;
    }
    if (after == 0) continue;
    const StampedPose& left = truth[after - 1];
    const StampedPose& right = truth[after];
    const double gap = SecondsBetween(left.stamp, right.stamp);
    if (gap > kLongestGapSeconds) continue;
    const double fraction = SecondsBetween(left.stamp, pose.stamp) / gap;
    pairs.push_back({pose.stamp, pose.T_map_base, Interpolate(left.T_map_base, right.T_map_base, fraction), stretch});
  }
  return pairs;
}

std::vector<Eigen::Vector3d> EstimatePositions(const std::vector<PosePair>& pairs) {
  std::vector<Eigen::Vector3d> positions;
  for (const PosePair& pair : pairs) positions.push_back(pair.estimate.translation);
  return positions;
}

std::vector<Eigen::Vector3d> TruthPositions(const std::vector<PosePair>& pairs) {
  std::vector<Eigen::Vector3d> positions;
  for (const PosePair& pair : pairs) positions.push_back(pair.truth.translation);
  return positions;
}

double Coverage(const Trajectory& estimate, const Trajectory& truth) {
  if (truth.empty()) return 0.0;
  const Timestamp begin = truth.front().stamp, end = truth.back().stamp;
  if (end <= begin) return 0.0;
  std::int64_t covered = 0;  // ns
  for (std::size_t i = 1; i < estimate.size(); ++i) {
    if (SecondsBetween(estimate[i - 1].stamp, estimate[i].stamp) > kLongestGapSeconds) continue;
    const Timestamp from = std::max(begin, estimate[i - 1].stamp);
    const Timestamp to = std::min(end, estimate[i].stamp);
    if (from < to) covered += to.nanoseconds - from.nanoseconds;
  }
  return static_cast<double>(covered) / static_cast<double>(end.nanoseconds - begin.nanoseconds);
}

}  // namespace planar_vslam::io
