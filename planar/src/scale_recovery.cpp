#include "planar_vslam/planar/scale_recovery.h"

#include <cmath>
#include <numeric>

namespace planar_vslam {

namespace {

using Points = std::vector<Eigen::Vector3d>;

// Motion vectors of a track, free of its origin: consecutive differences, or positions minus their mean.
Points Differences(const Points& positions, ScaleMethod method) {
  Points result;
  if (positions.empty()) return result;
  if (method == ScaleMethod::kSteps) {
    for (std::size_t k = 1; k < positions.size(); ++k) result.push_back(positions[k] - positions[k - 1]);
    return result;
  }
  const Eigen::Vector3d sum = std::accumulate(positions.begin(), positions.end(), Eigen::Vector3d(0, 0, 0));
  const Eigen::Vector3d mean = sum / static_cast<double>(positions.size());
  for (const Eigen::Vector3d& p : positions) result.push_back(p - mean);
  return result;
}

double SumOfProducts(const Points& a, const Points& b) {
  double sum = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += a[k].dot(b[k]);
  return sum;
}

// The one positive s with sum |s camera - lever|^2 = sum |odometry|^2, over motion vectors: the quadratic
//   cc s^2 - 2 cl s + (ll - oo) = 0.
// Unique while the base moves more than its lever arm swings (oo > ll); otherwise two scales explain the same motion.
std::optional<double> SolveScale(const Points& camera, const Points& lever, const Points& odometry) {
  const double cc = SumOfProducts(camera, camera);
  const double cl = SumOfProducts(camera, lever);
  const double ll = SumOfProducts(lever, lever);
  const double oo = SumOfProducts(odometry, odometry);
  if (!(cc > 0.0 && oo > ll)) return std::nullopt;
  const double scale = (cl + std::sqrt(cl * cl + cc * (oo - ll))) / cc;
  if (!(std::isfinite(scale) && scale > 0.0)) return std::nullopt;
  return scale;
}

std::optional<double> ScaleOfPairs(const std::vector<ScalePair>& pairs, ScaleMethod method) {
  Points visual, odometry;
  for (const ScalePair& pair : pairs) {
    visual.push_back(pair.p_visual);
    odometry.push_back(pair.p_odometry);
  }
  const Points no_lever(pairs.size(), Eigen::Vector3d::Zero());
  return SolveScale(Differences(visual, method), Differences(no_lever, method), Differences(odometry, method));
}

}  // namespace

std::optional<double> ScaleFromSteps(const std::vector<ScalePair>& pairs) {
  return ScaleOfPairs(pairs, ScaleMethod::kSteps);
}

std::optional<double> ScaleFromCentroids(const std::vector<ScalePair>& pairs) {
  return ScaleOfPairs(pairs, ScaleMethod::kCentroids);
}

std::optional<double> RecoverScale(const std::vector<LeverArmSample>& samples, ScaleMethod method,
                                   double min_distance) {
  constexpr std::size_t kMinSamples = 3;
  if (samples.size() < kMinSamples) return std::nullopt;
  Points camera, lever, odometry;
  double distance = 0.0;
  for (const LeverArmSample& sample : samples) {
    const Rigid3 T_odom_base = Embed3(sample.T_odom_base);
    if (!odometry.empty()) distance += (T_odom_base.translation - odometry.back()).norm();
    const Eigen::Quaterniond q_map_base = sample.T_map_camera.rotation * sample.T_base_camera.rotation.conjugate();
    camera.push_back(sample.T_map_camera.translation);
    lever.push_back(q_map_base * sample.T_base_camera.translation);
    odometry.push_back(T_odom_base.translation);
  }
  if (distance < min_distance) return std::nullopt;
  return SolveScale(Differences(camera, method), Differences(lever, method), Differences(odometry, method));
}

Rigid3 ScaleCameraMotion(const Rigid3& T_ref_base, const Rigid3& T_refbase_camera, const Rigid3& T_base_camera,
                         double scale) {
  Rigid3 T_camera_camera = T_refbase_camera.Inverse() * T_ref_base * T_base_camera;
  T_camera_camera.translation *= scale;
  return T_refbase_camera * T_camera_camera * T_base_camera.Inverse();
}

}  // namespace planar_vslam
