#pragma once
// Metric scale with its standard deviation, from wheel odometry over a visual track, and how independent sources of it
// are put together. The procedure:
//   1. Base positions at a first scale: that of the centroids (scale_recovery.h), corrected by the median over single
//      steps, which a few slips do not bend. a: odometry's way over a gap of keyframes, b: the visual one, r = b - a.
//   2. A step slipped where |r| or the difference of turns is beyond what the track's own scatter allows.
//   3. Without slips the scale is that of the centroids; with slips, or on a long track whose odometry has turned
//      away, the robust mean of log(a / b) over gaps of 3, 5, 8 and 12 keyframes that hold no slipped step.
//   4. Scatter over gaps of different length tells visual noise from odometry's, var(r) = 2 sigma_v^2 + rho^2 a, and
//      both together sigma: about rho^2 / D on a clean way D.
// Odometry's systematic error is not in the track; the caller adds it.
#include <optional>
#include <vector>

#include "planar_vslam/planar/scale_recovery.h"

namespace planar_vslam {

struct ScaleEstimate {
  double scale = 1.0;     // metric = scale * visual
  double sigma = 0.0;     // of log(scale), what the track's scatter tells
  double distance = 0.0;  // m, driven without slip
  int pairs = 0;          // of keyframes that took part
  int slipped = 0;        // steps between keyframes left out
};
// Nothing where the track is too short or too still to tell (see RecoverScale).
std::optional<ScaleEstimate> EstimateScale(const std::vector<LeverArmSample>& samples);

// One source's opinion of the factor a map is to be multiplied by.
struct ScaleMeasurement {
  double log_scale = 0.0;
  double sigma = 0.0;  // of log_scale, systematic part included
};
// The mean weighted by 1 / sigma^2. Nothing from nothing.
std::optional<ScaleMeasurement> Fuse(const std::vector<ScaleMeasurement>& sources);

}  // namespace planar_vslam
