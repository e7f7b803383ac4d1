// The cost and its linearisation.
#include <algorithm>
#include <cmath>

#include "planar_vslam/geometry/tangent_parts.h"
#include "planar_vslam/optimize/reprojection_factor.h"
#include "planar_vslam/planar/relative_pose_factor.h"
#include "schur_system.h"

namespace planar_vslam {
namespace {

struct Loss {
  double cost;    // rho(s) / 2
  double weight;  // rho'(s)
};
Loss Cauchy(double squared, double scale) {
  const double c = scale * scale, sum = 1.0 + squared / c;
  return {0.5 * c * std::log(sum), 1.0 / sum};
}

// The sum of logarithms of numbers of at least 1: products are cheap, their logarithm is not.
class LogSum {
 public:
  void Add(double factor) {
    constexpr double kLarge = 1e150;  // a factor of as much still fits
    product_ *= factor;
    if (product_ > kLarge) Close();
  }
  double Close() {
    sum_ += std::log(product_);
    product_ = 1.0;
    return sum_;
  }

 private:
  double product_ = 1.0, sum_ = 0.0;
};

// Jacobians for right perturbations -> for steps in the axes of the map.
template <int Rows>
Eigen::Matrix<double, Rows, 6> InMapAxes(const Eigen::Matrix<double, Rows, 6>& J, const Rigid3& T_map_base) {
  const Eigen::Matrix3d R_base_map = T_map_base.R().transpose();
  Eigen::Matrix<double, Rows, 6> turned;
  turned.template leftCols<3>() = J.template leftCols<3>() * R_base_map;
  turned.template rightCols<3>() = J.template rightCols<3>() * R_base_map;
  return turned;
}

}  // namespace

bool SchurSystem::IsFinite() const {
  return std::all_of(p_.points.begin(), p_.points.end(), [](const auto& point) { return point.p_map.allFinite(); }) &&
         std::all_of(p_.poses.begin(), p_.poses.end(), [](const auto& pose) {
           return pose.T_map_base.translation.allFinite() && pose.T_map_base.rotation.coeffs().allFinite();
         });
}

double SchurSystem::Evaluate() {
  cameras_ = CameraPoses(p_);
  double cost = EvaluatePixels() + EvaluateMotions();
  for (const std::size_t i : poses_of_slots_) {
    if (!p_.has_floor_prior(p_.poses[i])) continue;
    cost += 0.5 * PlanarPriorResidual(p_.poses[i].T_map_base, p_.floor_sigmas(p_.poses[i]), nullptr).squaredNorm();
  }
  for (const std::size_t l : p_.floor_points) {
    const double e = p_.points[l].p_map.z() / p_.planar.sigma_floor_point;
    cost += Cauchy(e * e, kFloorPointLoss).cost;
  }
  return cost;
}

double SchurSystem::EvaluatePixels() {
  const double c = p_.options.pixel_loss * p_.options.pixel_loss;
  LogSum losses;  // Cauchy's: c / 2 times the sum of log(1 + s / c)
  for (std::size_t l = 0; l < points_.size(); ++l) {
    const Eigen::Vector3d& p_map = p_.points[l].p_map;
    for (std::size_t i = points_[l].pixels_begin; i < points_[l].pixels_end; ++i) {
      Pixel& pixel = pixels_[i];
      const CameraPose& camera = cameras_[pixel.pose];
      pixel.p_camera.noalias() = camera.R * p_map + camera.t;
      pixel.weight = 0.0;
      if (!(pixel.p_camera.z() > kMinDepth)) continue;
      pixel.e = pixel.inverse_sigma * (p_.camera.ProjectUndistorted(pixel.p_camera) - pixel.pixel);
      if (!p_.whitening.empty()) pixel.e = (p_.whitening[pixel.source] * pixel.e).eval();
      const double sum = 1.0 + pixel.e.squaredNorm() / c;
      pixel.weight = 1.0 / sum;
      losses.Add(sum);
    }
  }
  return 0.5 * c * losses.Close();
}

double SchurSystem::EvaluateMotions() const {
  double cost = 0.0;
  for (const BundleMotion& m : p_.motions) {
    const Vector6d e = m.sqrt_information * RelativePoseResidual(p_.poses[m.i].T_map_base, p_.poses[m.j].T_map_base,
                                                                 m.T_i_j, nullptr, nullptr);
    cost += Cauchy(e(kPlanarRows).squaredNorm(), p_.options.odometry_loss).cost +
            Cauchy(e(kFloorRows).squaredNorm(), p_.options.tilt_loss).cost;
  }
  return cost;
}

void SchurSystem::Linearize() {
  H_.setZero(size_, size_);
  b_.setZero(size_);
  views_.clear();
  views_.reserve(pixels_.size());
  for (std::size_t l = 0; l < points_.size(); ++l) LinearizePoint(&points_[l], p_.points[l].p_map);
  for (const std::size_t l : p_.floor_points) {
    const double inverse_sigma = 1.0 / p_.planar.sigma_floor_point, e = p_.points[l].p_map.z() * inverse_sigma;
    const double weight = Cauchy(e * e, kFloorPointLoss).weight;
    points_[l].H(2, 2) += weight * inverse_sigma * inverse_sigma;
    points_[l].b.z() += weight * inverse_sigma * e;
  }
  LinearizeMotions();
  LinearizeFloor();
  KeepFreedom(&H_, &b_);
}

void SchurSystem::LinearizePoint(PointSystem* point, const Eigen::Vector3d& p_map) {
  point->views_begin = views_.size();
  point->H.setZero();
  point->b.setZero();
  for (std::size_t i = point->pixels_begin; i < point->pixels_end; ++i) {
    const Pixel& pixel = pixels_[i];
    if (pixel.weight == 0.0) continue;
    Eigen::Matrix<double, 2, 3> J =
        (pixel.inverse_sigma * ProjectionJacobian(p_.camera, pixel.p_camera)) * cameras_[pixel.pose].R;
    if (!p_.whitening.empty()) J = (p_.whitening[pixel.source] * J).eval();
    const Eigen::Matrix<double, 3, 2> weighted = pixel.weight * J.transpose();
    const Eigen::Matrix3d A = weighted * J;
    const Eigen::Vector3d g = weighted * pixel.e;
    point->H += A;
    point->b += g;
    if (slots_[pixel.pose] != kNoSlot) AddView(pixel, A, g, p_map);
  }
  point->views_end = views_.size();
}

void SchurSystem::AddView(const Pixel& pixel, const Eigen::Matrix3d& A, const Eigen::Vector3d& g,
                          const Eigen::Vector3d& p_map) {
  const Eigen::Index slot = slots_[pixel.pose];
  const Eigen::Vector3d v = p_map - p_.poses[pixel.pose].T_map_base.translation;
  views_.push_back({A, v, slot});
  const Eigen::Matrix3d A_skew = TimesSkew(A, v);
  const Eigen::Index at = 6 * slot;
  H_.block<3, 3>(at, at) += A;
  H_.block<3, 3>(at + 3, at) -= A_skew.transpose();
  H_.block<3, 3>(at + 3, at + 3) += TimesSkew(A_skew.transpose(), v).transpose();
  b_.segment<3>(at) -= g;
  b_.segment<3>(at + 3) += g.cross(v);
}

void SchurSystem::LinearizeMotions() {
  for (const BundleMotion& m : p_.motions) {
    const Rigid3 &T_map_i = p_.poses[m.i].T_map_base, &T_map_j = p_.poses[m.j].T_map_base;
    Matrix6d J_i, J_j;
    Vector6d e = m.sqrt_information * RelativePoseResidual(T_map_i, T_map_j, m.T_i_j, &J_i, &J_j);
    const double planar = std::sqrt(Cauchy(e(kPlanarRows).squaredNorm(), p_.options.odometry_loss).weight);
    const double tilt = std::sqrt(Cauchy(e(kFloorRows).squaredNorm(), p_.options.tilt_loss).weight);
    Vector6d scale;
    scale(kPlanarRows) = Eigen::Vector3d::Constant(planar);
    scale(kFloorRows) = Eigen::Vector3d::Constant(tilt);
    const Matrix6d weight = scale.asDiagonal() * m.sqrt_information;
    e = scale.cwiseProduct(e).eval();
    J_i = InMapAxes<6>(weight * J_i, T_map_i);
    J_j = InMapAxes<6>(weight * J_j, T_map_j);
    const Eigen::Index i = 6 * slots_[m.i], j = 6 * slots_[m.j];
    if (i >= 0) {
      H_.block<6, 6>(i, i) += J_i.transpose() * J_i;
      b_.segment<6>(i) += J_i.transpose() * e;
    }
    if (j >= 0) {
      H_.block<6, 6>(j, j) += J_j.transpose() * J_j;
      b_.segment<6>(j) += J_j.transpose() * e;
    }
    if (i >= 0 && j >= 0) H_.block<6, 6>(j, i) += J_j.transpose() * J_i;
  }
}

void SchurSystem::LinearizeFloor() {
  for (const std::size_t i : poses_of_slots_) {
    if (!p_.has_floor_prior(p_.poses[i])) continue;
    const Rigid3& T_map_base = p_.poses[i].T_map_base;
    Eigen::Matrix<double, 3, 6> J;
    const Eigen::Vector3d e = PlanarPriorResidual(T_map_base, p_.floor_sigmas(p_.poses[i]), &J);
    J = InMapAxes<3>(J, T_map_base);
    const Eigen::Index at = 6 * slots_[i];
    H_.block<6, 6>(at, at) += J.transpose() * J;
    b_.segment<6>(at) += J.transpose() * e;
  }
}

}  // namespace planar_vslam
