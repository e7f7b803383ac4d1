#pragma once
// Estimate poses beside the truth at their stamps.
#include <Eigen/Core>
#include <vector>

#include "planar_vslam/io/trajectory.h"

namespace planar_vslam::io {

// Longest gap, in estimate or truth, that counts as continuous (as in the OpenLORIS-Scene evaluation). Seconds.
constexpr double kLongestGapSeconds = 0.5;

struct PosePair {
  Timestamp stamp;
  Rigid3 estimate, truth;
  long stretch = 0;  // counts the gaps of truth before this pair: no segment is measured across one
};

// Truth is interpolated at the estimate's stamps, never across a gap and never beyond its ends.
std::vector<PosePair> PairByStamp(const Trajectory& estimate, const Trajectory& truth);

std::vector<Eigen::Vector3d> EstimatePositions(const std::vector<PosePair>& pairs);
std::vector<Eigen::Vector3d> TruthPositions(const std::vector<PosePair>& pairs);

// Share of the truth's span with estimates no further apart than the longest gap.
double Coverage(const Trajectory& estimate, const Trajectory& truth);

}  // namespace planar_vslam::io
