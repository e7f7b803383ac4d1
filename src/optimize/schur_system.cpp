#include "schur_system.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "planar_vslam/geometry/tangent_parts.h"

namespace planar_vslam {
namespace {

constexpr double kLeastCurvature = 1e-6;  // of H's diagonal, for damping: nothing may be known of a direction

// K^-1 of A = K K^T, both lower triangular. False where A is not positive definite.
bool InverseCholesky(const Eigen::Matrix3d& A, Eigen::Matrix3d* K_inverse) {
  if (!(A(0, 0) > 0.0)) return false;
  const double i00 = 1.0 / std::sqrt(A(0, 0));
  const double k10 = A(1, 0) * i00, k20 = A(2, 0) * i00;
  const double s11 = A(1, 1) - k10 * k10;
  if (!(s11 > 0.0)) return false;
  const double i11 = 1.0 / std::sqrt(s11);
  const double k21 = (A(2, 1) - k20 * k10) * i11;
  const double s22 = A(2, 2) - k20 * k20 - k21 * k21;
  if (!(s22 > 0.0)) return false;
  const double i22 = 1.0 / std::sqrt(s22);
  const double i10 = -k10 * i00 * i11;
  *K_inverse << i00, 0.0, 0.0, i10, i11, 0.0, -(k20 * i00 + k21 * i10) * i22, -k21 * i11 * i22, i22;
  return true;
}

}  // namespace

SchurSystem::SchurSystem(BundleProblem* problem) : p_(*problem) {
  slots_.assign(p_.poses.size(), kNoSlot);
  for (std::size_t i = 0; i < p_.poses.size(); ++i) {
    if (p_.poses[i].freedom == PoseFreedom::kFixed) continue;
    slots_[i] = static_cast<Eigen::Index>(poses_of_slots_.size());
    poses_of_slots_.push_back(i);
  }
  size_ = 6 * static_cast<Eigen::Index>(poses_of_slots_.size());
  points_.resize(p_.points.size());
  pixels_.reserve(p_.observations.size());
  std::size_t next = 0;
  for (std::size_t l = 0; l < points_.size(); ++l) {
    points_[l].pixels_begin = pixels_.size();
    for (; next < p_.observations.size() && p_.observations[next].point == l; ++next) {
      const BundleObservation& o = p_.observations[next];
      if (o.inlier) pixels_.push_back({o.pixel, o.inverse_sigma, o.pose, static_cast<std::uint32_t>(next)});
    }
    points_[l].pixels_end = pixels_.size();
  }
}

// Poses of three degrees of freedom do not move along the others.
void SchurSystem::KeepFreedom(Eigen::MatrixXd* H, Eigen::VectorXd* b) const {
  for (const std::size_t i : poses_of_slots_) {
    const PoseFreedom freedom = p_.poses[i].freedom;
    if (freedom == PoseFreedom::kFree) continue;
    for (const int row : freedom == PoseFreedom::kFloor ? kFloorRows : kPlanarRows) {
      const Eigen::Index at = 6 * slots_[i] + row;
      H->row(at).setZero();
      H->col(at).setZero();
      (*H)(at, at) = 1.0;
      (*b)(at) = 0.0;
    }
  }
}

// Solves the damped equations. False where they have no solution.
bool SchurSystem::Solve(double lambda) {
  S_ = H_;
  S_.diagonal() += lambda * H_.diagonal().cwiseMax(kLeastCurvature);
  r_ = -b_;
  for (PointSystem& point : points_) Eliminate(&point, lambda);
  KeepFreedom(&S_, &r_);
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(S_);
  if (cholesky.info() != Eigen::Success) return false;
  pose_step_ = cholesky.solve(r_);
  if (!pose_step_.allFinite()) return false;
  BackSubstitute();
  return true;
}

void SchurSystem::Eliminate(PointSystem* point, double lambda) {
  Eigen::Matrix3d damped = point->H;
  damped.diagonal() += lambda * point->H.diagonal().cwiseMax(kLeastCurvature);
  if (!InverseCholesky(damped, &point->K_inverse)) {
    point->K_inverse.setZero();
    return;
  }
  const Eigen::Vector3d u = point->K_inverse * point->b;
  U_.resize(point->views_end - point->views_begin);
  rows_.resize(U_.size());
  for (std::size_t a = 0; a < U_.size(); ++a) {
    const FreeView& view = views_[point->views_begin + a];
    const Eigen::Matrix3d X = point->K_inverse * view.A;
    U_[a].leftCols<3>() = -X;
    U_[a].rightCols<3>() = TimesSkew(X, view.v);
    rows_[a] = 6 * view.slot;
    r_.segment<6>(rows_[a]).noalias() += U_[a].transpose() * u;
  }
  subtract_pairs_(U_, rows_, size_, S_.data());
}

void SchurSystem::BackSubstitute() {
  point_steps_.resize(points_.size());
  for (std::size_t l = 0; l < points_.size(); ++l) {
    const PointSystem& point = points_[l];
    Eigen::Vector3d y = point.b;
    for (std::size_t i = point.views_begin; i < point.views_end; ++i) {
      const FreeView& view = views_[i];
      const Eigen::Vector3d d_t = pose_step_.segment<3>(6 * view.slot), d_r = pose_step_.segment<3>(6 * view.slot + 3);
      y.noalias() += view.A * (view.v.cross(d_r) - d_t);
    }
    point_steps_[l] = -(point.K_inverse.transpose() * (point.K_inverse * y));
  }
}

// Of the quadratic model: d^T (lambda D d - b) / 2.
double SchurSystem::PredictedDecrease(double lambda) const {
  double sum = pose_step_.dot(lambda * H_.diagonal().cwiseMax(kLeastCurvature).cwiseProduct(pose_step_) - b_);
  for (std::size_t l = 0; l < points_.size(); ++l) {
    const Eigen::Vector3d& d = point_steps_[l];
    sum += d.dot(lambda * points_[l].H.diagonal().cwiseMax(kLeastCurvature).cwiseProduct(d) - points_[l].b);
  }
  return 0.5 * sum;
}

void SchurSystem::Move() {
  for (std::size_t slot = 0; slot < poses_of_slots_.size(); ++slot) {
    Rigid3& T = p_.poses[poses_of_slots_[slot]].T_map_base;
    const Vector6d d = pose_step_.segment<6>(6 * static_cast<Eigen::Index>(slot));
    T = {(ExpSo3(d.tail<3>()) * T.rotation).normalized(), Eigen::Vector3d(T.translation + d.head<3>())};
  }
  for (std::size_t l = 0; l < points_.size(); ++l) p_.points[l].p_map += point_steps_[l];
}

}  // namespace planar_vslam
