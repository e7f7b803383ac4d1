#include "planar_vslam/optimize/pose_only.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "planar_vslam/geometry/chi_square.h"
#include "planar_vslam/geometry/tangent_parts.h"
#include "planar_vslam/optimize/planar_reprojection_factor.h"
#include "planar_vslam/planar/pose_manifold.h"

namespace planar_vslam {
namespace {

constexpr int kRounds = 4;
constexpr int kRobustRounds = 2;
constexpr int kIterationsPerRound = 10;
constexpr double kConvergedStep = 1e-5;  // m and rad

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

// The same for all 6 unknowns, in the camera's axes: with the point p of the camera, q of it from the base and the
// perturbation rotated into them, d p = -rho + [q]_x phi.
struct WeightedRows {
  WeightedRows(const CameraModel& camera, const PoseObservation& o, const Eigen::Vector3d& p,
               const Eigen::Vector3d& q) {
    const double inverse_z = 1.0 / p.z(), inverse_sigma = 1.0 / o.sigma;
    const double x = p.x() * inverse_z, y = p.y() * inverse_z;
    const double fx = camera.fx * inverse_sigma, fy = camera.fy * inverse_sigma;
    e = {fx * x + (camera.cx - o.pixel.x()) * inverse_sigma, fy * y + (camera.cy - o.pixel.y()) * inverse_sigma};
    const double u_x = fx * inverse_z, u_z = -u_x * x, v_y = fy * inverse_z, v_z = -v_y * y;
    J[0] = {-u_x, 0.0, -u_z, -u_z * q.y(), u_z * q.x() - u_x * q.z(), u_x * q.y()};
    J[1] = {0.0, -v_y, -v_z, v_y * q.z() - v_z * q.y(), v_z * q.x(), -v_y * q.x()};
  }

  void Whiten(const Eigen::Matrix2d& W) {
    const auto mix = [&W](double* first, double* second) {
      const double u = *first, v = *second;
      *first = W(0, 0) * u + W(0, 1) * v;
      *second = W(1, 0) * u + W(1, 1) * v;
    };
    mix(&e[0], &e[1]);
    for (std::size_t k = 0; k < 6; ++k) mix(&J[0][k], &J[1][k]);
  }

  std::array<double, 2> e;
  std::array<std::array<double, 6>, 2> J;
};

// Normal equations of points in the camera's axes; the lower half of H and, for the compiler's pairs, a bit more.
struct CameraSums {
  void Add(const WeightedRows& rows, double weight) {
    for (std::size_t i = 0; i < 6; ++i) {
      const double u = weight * rows.J[0][i], v = weight * rows.J[1][i];
      for (std::size_t j = 0; j <= (i | 1); ++j) H[i][j] += u * rows.J[0][j] + v * rows.J[1][j];
      b[i] += u * rows.e[0] + v * rows.e[1];
    }
  }

  NormalEquations InBaseAxes(const Eigen::Matrix3d& R_camera_base) const {
    Matrix6d H_camera;
    Vector6d b_camera;
    for (std::size_t i = 0; i < 6; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      b_camera(row) = b[i];
      for (std::size_t j = 0; j <= i; ++j) {
        const auto column = static_cast<Eigen::Index>(j);
        H_camera(row, column) = H_camera(column, row) = H[i][j];
      }
    }
    Matrix6d axes = Matrix6d::Zero();
    axes.topLeftCorner<3, 3>() = axes.bottomRightCorner<3, 3>() = R_camera_base;
    NormalEquations n;
    n.H = axes.transpose() * H_camera * axes;
    n.b = axes.transpose() * b_camera;
    n.cost = cost;
    return n;
  }

  std::array<std::array<double, 6>, 6> H{};
  std::array<double, 6> b{};
  double cost = 0.0;
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

  NormalEquations Linearize(const Rigid3& T_map_base, bool robust) const {
    CameraSums sums;
    const Eigen::Matrix3d R_camera_map = R_camera_base_ * T_map_base.R().transpose();
    const Eigen::Vector3d p_map_base = T_map_base.translation;
    for (std::size_t i = 0; i < observations_.size(); ++i) {
      const PoseObservation& o = observations_[i];
      if (!o.inlier) continue;
      const Eigen::Vector3d from_base = R_camera_map * (o.p_map - p_map_base);
      const Eigen::Vector3d p = from_base + T_camera_base_.translation;
      if (p.z() <= kMinDepth) {
        sums.cost += kChi2TwoDof95;
        continue;
      }
      WeightedRows rows(problem_.camera, o, p, from_base);
      if (!whitening_.empty()) rows.Whiten(whitening_[i]);
      const double squared = rows.e[0] * rows.e[0] + rows.e[1] * rows.e[1];
      double weight = 1.0;
      if (robust && squared > kChi2TwoDof95) {
        const double norm = std::sqrt(squared), delta = std::sqrt(kChi2TwoDof95);
        weight = delta / norm;
        sums.cost += 2.0 * delta * norm - kChi2TwoDof95;
      } else {
        sums.cost += squared;
      }
      sums.Add(rows, weight);
    }
    NormalEquations n = sums.InBaseAxes(R_camera_base_);
    AddPriors(T_map_base, &n);
    return n;
  }

  // Levenberg-Marquardt from T_map_base; returns the last accepted pose.
  Rigid3 Solve(Rigid3 T_map_base, bool robust) const {
    double lambda = 1e-6;
    NormalEquations n = Linearize(T_map_base, robust);
    for (int i = 0; i < kIterationsPerRound; ++i) {
      const Vector6d step = Step(T_map_base, n, lambda);
      if (!step.allFinite()) break;
      const Rigid3 candidate = T_map_base * ExpSe3(step);
      if (step.norm() < kConvergedStep) return candidate;  // too near for the cost to tell them apart
      const NormalEquations next = Linearize(candidate, robust);
      if (next.cost <= n.cost) {
        T_map_base = candidate;
        n = next;
        lambda = std::max(lambda * 0.1, 1e-9);
      } else {
        lambda = std::max(lambda, 1e-6) * 100.0;
        if (lambda > 1e6) break;
      }
    }
    return T_map_base;
  }

  // Chi-square classes at `T_map_base`: inlier count and mean squared error of the inliers. Whether any class changed.
  bool Classify(const Rigid3& T_map_base, PoseOnlyResult* result) const {
    const Rigid3 T_camera_map = T_camera_base_ * T_map_base.Inverse();
    const Eigen::Matrix3d R_camera_map = T_camera_map.R();
    double sum = 0.0;
    int count = 0;
    bool changed = false;
    for (std::size_t i = 0; i < observations_.size(); ++i) {
      PoseObservation& o = observations_[i];
      Eigen::Vector2d e;
      const double squared = SquaredError(i, R_camera_map * o.p_map + T_camera_map.translation, &e);
      const bool inlier = squared <= kChi2TwoDof95;
      changed = changed || inlier != o.inlier;
      o.inlier = inlier;
      if (!o.inlier) continue;
      sum += squared;
      ++count;
    }
    result->inliers = count;
    result->mean_square_error = count > 0 ? sum / count : 0.0;
    return changed;
  }

  Matrix6d Information(const Rigid3& T_map_base) const {
    return planar_ ? Matrix6d(FloorCovariance(T_map_base).inverse()) : Linearize(T_map_base, true).H;
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

  void AddPriors(const Rigid3& T_map_base, NormalEquations* n) const {
    if (problem_.prior.has_value()) {
      const Vector6d log = LogSe3(problem_.prior->T_map_base.Inverse() * T_map_base);
      if (planar_prior_.has_value()) {
        AddPrior(*planar_prior_, log, n);
      } else {
        AddPrior(problem_.prior->sqrt_information, log, n);
      }
    }
    if (problem_.floor == PlanarMode::kSoftSe3) {
      Eigen::Matrix<double, 3, 6> J;
      const Eigen::Vector3d e = PlanarPriorResidual(T_map_base, {problem_.sigma_height, problem_.sigma_tilt}, &J);
      AddRows(J, e, n);
    }
  }

  template <int Rows>
  static void AddPrior(const Eigen::Matrix<double, Rows, 6>& weight, const Vector6d& log, NormalEquations* n) {
    const Eigen::Matrix<double, Rows, 1> e = weight * log;
    const Eigen::Matrix<double, Rows, 6> J = weight * RightJacobianInverseSe3(log);
    AddRows(J, e, n);
  }
  template <int Rows>
  static void AddRows(const Eigen::Matrix<double, Rows, 6>& J, const Eigen::Matrix<double, Rows, 1>& e,
                      NormalEquations* n) {
    n->cost += e.squaredNorm();
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
    const bool changed = solver.Classify(result.T_map_base, &result);
    constexpr int kFewestForAPose = 3;
    if (result.inliers < kFewestForAPose) break;
    // All that took part are inliers, whose errors the kernel leaves alone: the next round would end where it begins.
    if (!changed && problem.floor != PlanarMode::kSe2Xyz) break;
  }
  result.information = solver.Information(result.T_map_base);
  return result;
}

}  // namespace planar_vslam
