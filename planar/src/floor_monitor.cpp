#include "planar_vslam/planar/floor_monitor.h"

#include "planar_vslam/planar/planar_prior.h"

namespace planar_vslam {
namespace {

// 7 sigma: far beyond the noise of a pose, because a map of few landmarks tilts and bends by itself (which at times
// reaches this limit too, on a flat floor). A street or a ramp of a few degrees passes it within its first metres. An
// empirical limit: see BENCHMARK.md.
constexpr double kReleaseSquared = 49.0;
constexpr double kChi2ThreeDof90 = 6.251;  // chi-square, 3 dof, 90 %
constexpr int kReleaseAfter = 3;
constexpr int kResumeAfter = 10;

}  // namespace

double FloorDistance(const Rigid3& T_map_base, const Matrix6d& covariance, double sigma_height, double sigma_tilt) {
  Eigen::Matrix<double, 3, 6> J;
  const Eigen::Vector3d whitened = PlanarPriorResidual(T_map_base, sigma_height, sigma_tilt, &J);
  // Residual and Jacobian are divided by the prior's sigmas, so the prior's own covariance is the identity.
  const Eigen::Matrix3d S = J * covariance * J.transpose() + Eigen::Matrix3d::Identity();
  return whitened.dot(S.ldlt().solve(whitened));
}

void FloorMonitor::Add(double squared_distance) {
  const bool against = on_floor_ ? squared_distance > kReleaseSquared : squared_distance < kChi2ThreeDof90;
  streak_ = against ? streak_ + 1 : 0;
  if (streak_ < (on_floor_ ? kReleaseAfter : kResumeAfter)) return;
  on_floor_ = !on_floor_;
  streak_ = 0;
}

}  // namespace planar_vslam
