#include "two_view_motions.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace planar_vslam {

std::vector<Rigid3> MotionsFromHomography(const Eigen::Matrix3d& H) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d& U = svd.matrixU();
  const Eigen::Matrix3d& V = svd.matrixV();
  const double d1 = svd.singularValues()(0);
  const double d2 = svd.singularValues()(1);
  const double d3 = svd.singularValues()(2);
  // Three equal singular values: H is a rotation. Translation below this share of the plane's distance is rounding.
  constexpr double kRotationRatio = 1.0 + 1e-6;
  if (!(d3 > 0.0) || d1 / d3 < kRotationRatio) return {};
  const double s = U.determinant() * V.determinant();

  // Faugeras and Lustman: with the plane's distance +-d2, normal (x1, 0, x3) and translation in the frames of the SVD.
  const double span = d1 * d1 - d3 * d3;
  const double x1_size = std::sqrt(std::max(0.0, (d1 * d1 - d2 * d2) / span));
  const double x3_size = std::sqrt(std::max(0.0, (d2 * d2 - d3 * d3) / span));
  std::vector<Rigid3> motions;
  for (const double plane_sign : {1.0, -1.0}) {
    for (const double sign1 : {1.0, -1.0}) {
      for (const double sign3 : {1.0, -1.0}) {
        const double x1 = sign1 * x1_size;
        const double x3 = sign3 * x3_size;
        const double sine = (d1 - plane_sign * d3) * x1 * x3 / d2;
        const double cosine = (d3 * x1 * x1 + plane_sign * d1 * x3 * x3) / d2;
        Eigen::Matrix3d rotation;
        rotation << cosine, 0.0, -plane_sign * sine, 0.0, plane_sign, 0.0, sine, 0.0, plane_sign * cosine;
        const Eigen::Vector3d translation(x1, 0.0, -plane_sign * x3);
        motions.emplace_back(Eigen::Matrix3d(s * U * rotation * V.transpose()),
                             Eigen::Vector3d((U * translation).normalized()));
      }
    }
  }
  return motions;
}

std::vector<Rigid3> MotionsFromEssential(const Eigen::Matrix3d& E) {
  // Hartley and Zisserman result 9.19.
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(E, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d& U = svd.matrixU();
  const Eigen::Matrix3d& V = svd.matrixV();
  Eigen::Matrix3d W;
  W << 0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0;
  const double s = U.determinant() * V.determinant();  // makes the rotations proper
  const Eigen::Matrix3d rotation_a = s * U * W * V.transpose();
  const Eigen::Matrix3d rotation_b = s * U * W.transpose() * V.transpose();
  const Eigen::Vector3d direction = U.col(2);
  return {Rigid3(rotation_a, direction), Rigid3(rotation_a, Eigen::Vector3d(-direction)), Rigid3(rotation_b, direction),
          Rigid3(rotation_b, Eigen::Vector3d(-direction))};
}

}  // namespace planar_vslam
