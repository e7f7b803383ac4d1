#include "planar_vslam/optimize/pose_only.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "planar_vslam/geometry/tangent_parts.h"
#include "planar_vslam/optimize/planar_reprojection_factor.h"
#include "planar_vslam/planar/pose_manifold.h"

namespace planar_vslam {
namespace {

constexpr double kChi2TwoDof95 = 5.991;  // chi-square, 2 dof, 95 %
constexpr int kRounds = 4;
constexpr int kRobustRounds = 2;
constexpr int kIterationsPerRound = 10;
constexpr double kConvergedStep = 1e-6;  // m and rad

struct NormalEquations {
  Matrix6d H = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();
  double cost = 0.0;
};

// Reprojection error of one point and its derivative by the point in base axes, both weighted.
struct LinearizedPoint {
  Eigen::Vector2d e;
  Eigen::Vector3d p_base;
  Eigen::Matrix<double, 2, 3> J_base;

  Eigen::Matrix<double, 2, 6> PoseJacobian() const {
    Eigen::Matrix<double, 2, 6> J;
    J.leftCols<3>() = -J_base;
    J.rightCols<3>() = J_base * Skew(p_base);
    return J;
  }
};

class PoseSolver {
 public:
  PoseSolver(const PoseOnlyProblem& problem, std::vector<PoseObservation>& observations)
      : problem_(problem),
        observations_(observations),
        planar_(IsPlanar(problem.floor)),
        T_camera_base_(problem.T_base_camera.Inverse()) {
    R_camera_base_ = T_camera_base_.R();
    if (problem.prior.has_value() && (planar_ || problem.prior->planar)) SetPlanarPrior();
  }

  // The weights of se2_xyz at `T_map_base`.
  void RefreshWhitening(const Rigid3& T_map_base) {
    if (problem_.floor != PlanarMode::kSe2Xyz) return;
    const Eigen::Matrix3d R_base_map = T_map_base.R().transpose();
    whitening_.assign(observations_.size(), Eigen::Matrix2d::Identity());
    for (std::size_t i = 0; i < observations_.size(); ++i) {
      const Eigen::Vector3d point_from_base = observations_[i].p_map - T_map_base.translation;
      const Eigen::Vector3d p_base = R_base_map * point_from_base;
      const Eigen::Vector3d p = R_camera_base_ * p_base + T_camera_base_.translation;
      if (p.z() <= kMinDepth) continue;
      const Eigen::Matrix<double, 2, 3> J_point = BaseJacobian(observations_[i], p) * R_base_map;
      whitening_[i] =
          FloorWhitening(FloorErrorJacobian(J_point, point_from_base), problem_.sigma_height, problem_.sigma_tilt);
    }
  }

  NormalEquations Linearize(const Rigid3& T_map_base, bool robust, bool with_jacobians) const {
    NormalEquations n;
    const Eigen::Matrix3d R_base_map = T_map_base.R().transpose();
    for (std::size_t i = 0; i < observations_.size(); ++i) {
      const PoseObservation& o = observations_[i];
      if (!o.inlier) continue;
      LinearizedPoint point;
      point.p_base = R_base_map * (o.p_map - T_map_base.translation);
      const Eigen::Vector3d p = R_camera_base_ * point.p_base + T_camera_base_.translation;
      const double squared = SquaredError(i, p, &point.e);
      if (squared >= kBehindCamera) {
        n.cost += kChi2TwoDof95;
        continue;
      }
      double weight = 1.0;
      if (robust && squared > kChi2TwoDof95) {
        const double norm = std::sqrt(squared), delta = std::sqrt(kChi2TwoDof95);
        weight = delta / norm;
        n.cost += 2.0 * delta * norm - kChi2TwoDof95;
      } else {
        n.cost += squared;
      }
      if (!with_jacobians) continue;
      point.J_base = Whitened(i, BaseJacobian(o, p));
      const Eigen::Matrix<double, 2, 6> J = point.PoseJacobian();
      n.H.noalias() += weight * J.transpose() * J;
      n.b.noalias() += weight * J.transpose() * point.e;
    }
    AddPriors(T_map_base, with_jacobians, &n);
    return n;
  }

  // Levenberg-Marquardt from T_map_base; returns the last accepted pose.
  Rigid3 Solve(Rigid3 T_map_base, bool robust) const {
    double lambda = 1e-6;
    NormalEquations n = Linearize(T_map_base, robust, true);
    for (int i = 0; i < kIterationsPerRound; ++i) {
      const Vector6d step = Step(T_map_base, n, lambda);
      if (!step.allFinite()) break;
      const Rigid3 candidate = T_map_base * ExpSe3(step);
      const double cost = Linearize(candidate, robust, false).cost;
      if (cost <= n.cost) {
        T_map_base = candidate;
        lambda = std::max(lambda * 0.1, 1e-9);
        if (step.norm() < kConvergedStep) break;
        n = Linearize(T_map_base, robust, true);
      } else {
        lambda = std::max(lambda, 1e-6) * 100.0;
        if (lambda > 1e6) break;
      }
    }
    return T_map_base;
  }

  // Chi-square classes at `T_map_base`: inlier count and mean squared error of the inliers.
  void Classify(const Rigid3& T_map_base, PoseOnlyResult* result) const {
    const Rigid3 T_camera_map = T_camera_base_ * T_map_base.Inverse();
    const Eigen::Matrix3d R_camera_map = T_camera_map.R();
    double sum = 0.0;
    int count = 0;
    for (std::size_t i = 0; i < observations_.size(); ++i) {
      PoseObservation& o = observations_[i];
      Eigen::Vector2d e;
      const double squared = SquaredError(i, R_camera_map * o.p_map + T_camera_map.translation, &e);
      o.inlier = squared <= kChi2TwoDof95;
      if (!o.inlier) continue;
      sum += squared;
      ++count;
    }
    result->inliers = count;
    result->mean_square_error = count > 0 ? sum / count : 0.0;
  }

  Matrix6d Information(const Rigid3& T_map_base) const {
    return planar_ ? Matrix6d(FloorCovariance(T_map_base).inverse()) : Linearize(T_map_base, true, true).H;
  }

 private:
  static constexpr double kBehindCamera = 1e12;  // a squared error beyond any limit

  double SquaredError(std::size_t i, const Eigen::Vector3d& p_camera, Eigen::Vector2d* e) const {
    if (p_camera.z() <= kMinDepth) return kBehindCamera;
    const PoseObservation& o = observations_[i];
    *e = (problem_.camera.ProjectUndistorted(p_camera) - o.pixel) / o.sigma;
    if (!whitening_.empty()) *e = (whitening_[i] * *e).eval();
    return e->squaredNorm();
  }

  Eigen::Matrix<double, 2, 3> BaseJacobian(const PoseObservation& o, const Eigen::Vector3d& p) const {
    const double iz = 1.0 / p.z();
    const CameraModel& c = problem_.camera;
    Eigen::Matrix<double, 2, 3> J_pi;
    J_pi << c.fx * iz, 0.0, -c.fx * p.x() * iz * iz, 0.0, c.fy * iz, -c.fy * p.y() * iz * iz;
    return (J_pi * R_camera_base_) / o.sigma;
  }
  template <class Matrix>
  Matrix Whitened(std::size_t i, const Matrix& J) const {
    return whitening_.empty() ? J : Matrix(whitening_[i] * J);
  }

  // Of the damped normal equations, as a right perturbation.
  Vector6d Step(const Rigid3& T_map_base, const NormalEquations& n, double lambda) const {
    if (planar_) {
      const Eigen::Matrix<double, 6, 3> E = FloorTangent(T_map_base);
      Eigen::Matrix3d damped = E.transpose() * n.H * E;
      damped.diagonal() += (lambda * damped.diagonal() + Eigen::Vector3d::Constant(1e-9)).eval();
      return E * damped.ldlt().solve(-E.transpose() * n.b);
    }
    Matrix6d damped = n.H;
    damped.diagonal() += lambda * n.H.diagonal() + Vector6d::Constant(1e-9);
    return damped.ldlt().solve(-n.b);
  }

  // The prior's marginal of x, y and yaw: its 6-dof weight would take height and tilt for known.
  void SetPlanarPrior() {
    const Matrix6d& S = problem_.prior->sqrt_information;
    const Matrix6d covariance = (S.transpose() * S).inverse();
    const Eigen::Matrix3d marginal = covariance(kPlanarRows, kPlanarRows);
    const Eigen::Matrix3d L_inverse =
        Eigen::LLT<Eigen::Matrix3d>(marginal).matrixL().solve(Eigen::Matrix3d::Identity());
    planar_prior_.emplace(Eigen::Matrix<double, 3, 6>::Zero());
    (*planar_prior_)(Eigen::all, kPlanarRows) = L_inverse;
  }

  void AddPriors(const Rigid3& T_map_base, bool with_jacobians, NormalEquations* n) const {
    if (problem_.prior.has_value()) {
      const Vector6d log = LogSe3(problem_.prior->T_map_base.Inverse() * T_map_base);
      if (planar_prior_.has_value()) {
        AddPrior(*planar_prior_, log, with_jacobians, n);
      } else {
        AddPrior(problem_.prior->sqrt_information, log, with_jacobians, n);
      }
    }
    if (problem_.floor == PlanarMode::kSoftSe3) {
      Eigen::Matrix<double, 3, 6> J;
      const Eigen::Vector3d e =
          PlanarPriorResidual(T_map_base, problem_.sigma_height, problem_.sigma_tilt, with_jacobians ? &J : nullptr);
      n->cost += e.squaredNorm();
      if (with_jacobians) {
        n->H.noalias() += J.transpose() * J;
        n->b.noalias() += J.transpose() * e;
      }
    }
  }

  template <int Rows>
  static void AddPrior(const Eigen::Matrix<double, Rows, 6>& weight, const Vector6d& log, bool with_jacobians,
                       NormalEquations* n) {
    const Eigen::Matrix<double, Rows, 1> e = weight * log;
    n->cost += e.squaredNorm();
    if (!with_jacobians) return;
    const Eigen::Matrix<double, Rows, 6> J = weight * RightJacobianInverseSe3(log);
    n->H.noalias() += J.transpose() * J;
    n->b.noalias() += J.transpose() * e;
  }

  // Of the pose on the floor (pose_only.h).
  Matrix6d FloorCovariance(const Rigid3& T_map_base) const {
    constexpr double kFree = 1e-9;  // 1/m^2, 1/rad^2: what nothing measures is this well known, in H and in what errs
    const Eigen::Matrix3d R_base_map = T_map_base.R().transpose();
    const Eigen::Matrix<double, 6, 3> E = FloorTangent(T_map_base);
    Eigen::Matrix3d H = kFree * Eigen::Matrix3d::Identity(), N = H, B = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < observations_.size(); ++i) {
      const PoseObservation& o = observations_[i];
      if (!o.inlier) continue;
      const Eigen::Vector3d point_from_base = o.p_map - T_map_base.translation;
      LinearizedPoint point;
      point.p_base = R_base_map * point_from_base;
      const Eigen::Vector3d p = R_camera_base_ * point.p_base + T_camera_base_.translation;
      if (p.z() <= kMinDepth) continue;
      point.J_base = Whitened(i, BaseJacobian(o, p));
      const Eigen::Matrix<double, 2, 3> J = point.PoseJacobian() * E;
      H.noalias() += J.transpose() * J;
      B.noalias() += J.transpose() * FloorErrorJacobian(point.J_base * R_base_map, point_from_base);
      const Eigen::Matrix<double, 2, 3> twice = whitening_.empty() ? J : (whitening_[i].transpose() * J).eval();
      N.noalias() += twice.transpose() * twice;
    }
    if (problem_.prior.has_value()) {
      const Vector6d log = LogSe3(problem_.prior->T_map_base.Inverse() * T_map_base);
      const Eigen::Matrix3d J = *planar_prior_ * RightJacobianInverseSe3(log) * E;
      H.noalias() += J.transpose() * J;
      N.noalias() += J.transpose() * J;
    }
    const double z = problem_.sigma_height * problem_.sigma_height, tilt = problem_.sigma_tilt * problem_.sigma_tilt;
    const Eigen::Matrix3d sigma_f = Eigen::Vector3d(z, tilt, tilt).asDiagonal();
    const Eigen::Matrix3d H_inverse = H.inverse();
    Matrix6d joint;
    joint.topLeftCorner<3, 3>() = H_inverse * (B * sigma_f * B.transpose() + N) * H_inverse;
    joint.topRightCorner<3, 3>() = -H_inverse * B * sigma_f;
    joint.bottomLeftCorner<3, 3>() = joint.topRightCorner<3, 3>().transpose();
    joint.bottomRightCorner<3, 3>() = sigma_f;
    Matrix6d axes = Matrix6d::Zero();
    axes.leftCols<3>() = E;
    axes.block<3, 1>(0, 3) = R_base_map.col(2);
    axes.block<3, 2>(3, 4) = R_base_map.leftCols<2>();
    return axes * joint * axes.transpose();
  }

  const PoseOnlyProblem& problem_;
  std::vector<PoseObservation>& observations_;
  bool planar_;  // 3 unknowns
  Rigid3 T_camera_base_;
  Eigen::Matrix3d R_camera_base_;
  std::vector<Eigen::Matrix2d> whitening_;                   // of se2_xyz, else empty
  std::optional<Eigen::Matrix<double, 3, 6>> planar_prior_;  // weight of the prior, where only its marginal takes part
};

}  // namespace

PoseOnlyResult OptimizePose(const PoseOnlyProblem& problem, std::vector<PoseObservation>* observations) {
  PoseSolver solver(problem, *observations);
  PoseOnlyResult result;
  result.T_map_base = IsPlanar(problem.floor) ? Embed3(ProjectToPlane(problem.T_map_base)) : problem.T_map_base;
  solver.RefreshWhitening(result.T_map_base);
  for (int round = 0; round < kRounds; ++round) {
    result.T_map_base = solver.Solve(result.T_map_base, round < kRobustRounds);
    solver.RefreshWhitening(result.T_map_base);
    solver.Classify(result.T_map_base, &result);
    constexpr int kFewestForAPose = 3;
    if (result.inliers < kFewestForAPose) break;
  }
  result.information = solver.Information(result.T_map_base);
  return result;
}

}  // namespace planar_vslam
