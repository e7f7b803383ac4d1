#pragma once
// Homography and fundamental matrix of two views, robustly fitted to the same matches.
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace planar_vslam {

struct ModelFit {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();  // between pixels
  double score = 0.0;                                // sum of truncated squared errors, higher is better
  std::vector<std::size_t> inliers;                  // indices of the matches, ascending
};

struct TwoViewModels {
  ModelFit homography;   // second ~ H * first
  ModelFit fundamental;  // second^T * F * first = 0
};

// Fewest matches FitTwoViewModels takes: the sample of the fundamental matrix.
constexpr std::size_t kTwoViewSample = 8;

TwoViewModels FitTwoViewModels(const std::vector<Eigen::Vector2d>& first, const std::vector<Eigen::Vector2d>& second,
                               int ransac_iterations, double pixel_sigma, std::uint32_t seed);

}  // namespace planar_vslam
