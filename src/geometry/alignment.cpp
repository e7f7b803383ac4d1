#include "planar_vslam/geometry/alignment.h"

#include <Eigen/SVD>
#include <cmath>

#include "planar_vslam/geometry/check.h"

namespace planar_vslam {

namespace {

Eigen::Vector3d Mean(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

// Heading that turns the centred source points best onto the centred target points.
Eigen::Quaterniond PlaneRotation(const Eigen::Matrix3d& covariance) {
  const double cosine = covariance(0, 0) + covariance(1, 1);
  const double sine = covariance(1, 0) - covariance(0, 1);
  return Eigen::Quaterniond(Eigen::AngleAxisd(std::atan2(sine, cosine), Eigen::Vector3d::UnitZ()));
}

}  // namespace

Similarity3 AlignPoints(const std::vector<Eigen::Vector3d>& source, const std::vector<Eigen::Vector3d>& target,
                        Alignment alignment) {
  PV_CHECK(source.size() == target.size(), source.size() << " source and " << target.size() << " target points");
  Similarity3 result;
  const std::size_t needed = alignment == Alignment::kSe2 ? 2 : 3;
  if (alignment == Alignment::kNone || source.size() < needed) return result;

  const Eigen::Vector3d source_mean = Mean(source);
  const Eigen::Vector3d target_mean = Mean(target);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // sum of target * source^T, centred
  double source_variance = 0.0;
  for (std::size_t i = 0; i < source.size(); ++i) {
    const Eigen::Vector3d centered = source[i] - source_mean;
    covariance += (target[i] - target_mean) * centered.transpose();
    source_variance += centered.squaredNorm();
  }

  if (alignment == Alignment::kSe2) {
    result.T_target_source.rotation = PlaneRotation(covariance);
    result.T_target_source.translation = target_mean - result.T_target_source.rotation * source_mean;
    result.T_target_source.translation.z() = 0.0;
    return result;
  }

  // Umeyama eq. 39 to 43: the sign keeps the rotation proper when the points are mirrored or flat.
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0) signs.z() = -1.0;
  const Eigen::Matrix3d rotation = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  if (alignment == Alignment::kSim3 && source_variance > 0.0) {
    result.scale = svd.singularValues().dot(signs) / source_variance;
  }
  result.T_target_source = Rigid3(rotation, target_mean - result.scale * (rotation * source_mean));
  return result;
}

}  // namespace planar_vslam
