#pragma once
// Relative pose of two views from point matches, scale unknown: a homography and a fundamental matrix are fitted by
// RANSAC, the better supported one is decomposed (Hartley and Zisserman ch. 9 to 11; Faugeras and Lustman 1988 for the
// homography; model selection after Mur-Artal, Montiel, Tardos, TRO 2015, eq. R_H), and the motion with most points in
// front of both cameras wins.
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "planar_vslam/geometry/rigid3.h"

namespace planar_vslam {

enum class TwoViewStatus {
  kOk,
  kTooFewMatches,  // fewer than 8
  kNoModel,        // neither model found enough inliers
  kAmbiguous,      // two motions explain the points about equally well
  kLowParallax,    // rays nearly parallel: (nearly) pure rotation
  kTooFewPoints,   // fewer triangulated points than asked for
};

struct TwoViewOptions {
  int ransac_iterations = 200;
  double pixel_sigma = 1.0;        // px, of the matched keypoints
  double min_parallax = 1.0;       // degrees, of the median point
  int min_points = 50;             // triangulated points
  double homography_ratio = 0.40;  // choose the homography when R_H exceeds this
};

struct TwoViewResult {
  TwoViewStatus status = TwoViewStatus::kTooFewMatches;
  bool used_homography = false;
  Rigid3 T_first_second;                               // unit translation
  std::vector<std::optional<Eigen::Vector3d>> points;  // per match, in the first camera's frame; unset for outliers
  double parallax_degrees = 0.0;                       // median over the points
};

// `first` and `second` are undistorted pixels of the matches, (fx, fy, cx, cy) the common intrinsics. `seed` fixes the
// random samples.
TwoViewResult EstimateTwoViewMotion(const std::vector<Eigen::Vector2d>& first,
                                    const std::vector<Eigen::Vector2d>& second, double fx, double fy, double cx,
                                    double cy, const TwoViewOptions& options, std::uint32_t seed);

}  // namespace planar_vslam
