#include "planar_vslam/optimize/pose_only.h"

#include <algorithm>
#include <cmath>

#include "planar_vslam/optimize/reprojection_factor.h"

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

// Whitened reprojection error; nothing in front of the camera gives an error beyond any limit.
double SquaredError(const PoseObservation& o, const Eigen::Vector3d& p_camera, const CameraModel& camera,
                    Eigen::Vector2d* e) {
  if (p_camera.z() <= kMinDepth) return 1e12;
  *e = (camera.ProjectUndistorted(p_camera) - o.pixel) / o.sigma;
  return e->squaredNorm();
}

class PoseSolver {
 public:
  PoseSolver(const PoseOnlyProblem& problem, std::vector<PoseObservation>& observations)
      : problem_(problem), observations_(observations), T_camera_base_(problem.T_base_camera.Inverse()) {
    R_camera_base_ = T_camera_base_.R();
  }

  NormalEquations Linearize(const Rigid3& T_map_base, bool robust, bool with_jacobians) const {
    NormalEquations n;
    const Eigen::Matrix3d R_base_map = T_map_base.R().transpose();
    for (const PoseObservation& o : observations_) {
      if (!o.inlier) continue;
      const Eigen::Vector3d p_base = R_base_map * (o.p_map - T_map_base.translation);
      const Eigen::Vector3d p = R_camera_base_ * p_base + T_camera_base_.translation;
      Eigen::Vector2d e;
      const double squared = SquaredError(o, p, problem_.camera, &e);
      if (squared >= 1e12) {
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
      if (with_jacobians) Accumulate(o, p_base, p, e, weight, &n);
    }
    AddPriors(T_map_base, with_jacobians, &n);
    return n;
  }

  // Levenberg-Marquardt from T_map_base; returns the last accepted pose.
  Rigid3 Solve(Rigid3 T_map_base, bool robust) const {
    double lambda = 1e-6;
    NormalEquations n = Linearize(T_map_base, robust, true);
    for (int i = 0; i < kIterationsPerRound; ++i) {
      Matrix6d damped = n.H;
      damped.diagonal() += lambda * n.H.diagonal() + Vector6d::Constant(1e-9);
      const Vector6d step = damped.ldlt().solve(-n.b);
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
    for (PoseObservation& o : observations_) {
      Eigen::Vector2d e;
      const double squared = SquaredError(o, R_camera_map * o.p_map + T_camera_map.translation, problem_.camera, &e);
      o.inlier = squared <= kChi2TwoDof95;
      if (!o.inlier) continue;
      sum += squared;
      ++count;
    }
    result->inliers = count;
    result->mean_square_error = count > 0 ? sum / count : 0.0;
  }

 private:
  void Accumulate(const PoseObservation& o, const Eigen::Vector3d& p_base, const Eigen::Vector3d& p,
                  const Eigen::Vector2d& e, double weight, NormalEquations* n) const {
    const double iz = 1.0 / p.z();
    const CameraModel& c = problem_.camera;
    Eigen::Matrix<double, 2, 3> J_pi;
    J_pi << c.fx * iz, 0.0, -c.fx * p.x() * iz * iz, 0.0, c.fy * iz, -c.fy * p.y() * iz * iz;
    const Eigen::Matrix<double, 2, 3> J_base = (J_pi * R_camera_base_) / o.sigma;
    Eigen::Matrix<double, 2, 6> J;
    J.leftCols<3>() = -J_base;
    J.rightCols<3>() = J_base * Skew(p_base);
    n->H.noalias() += weight * J.transpose() * J;
    n->b.noalias() += weight * J.transpose() * e;
  }

  void AddPriors(const Rigid3& T_map_base, bool with_jacobians, NormalEquations* n) const {
    if (problem_.prior.has_value()) {
      const Vector6d log = LogSe3(problem_.prior->T_map_base.Inverse() * T_map_base);
      const Vector6d e = problem_.prior->sqrt_information * log;
      n->cost += e.squaredNorm();
      if (with_jacobians) {
        const Matrix6d J = problem_.prior->sqrt_information * RightJacobianInverseSe3(log);
        n->H.noalias() += J.transpose() * J;
        n->b.noalias() += J.transpose() * e;
      }
    }
    if (problem_.planar) {
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

  const PoseOnlyProblem& problem_;
  std::vector<PoseObservation>& observations_;
  Rigid3 T_camera_base_;
  Eigen::Matrix3d R_camera_base_;
};

}  // namespace

PoseOnlyResult OptimizePose(const PoseOnlyProblem& problem, std::vector<PoseObservation>* observations) {
  PoseSolver solver(problem, *observations);
  PoseOnlyResult result;
  result.T_map_base = problem.T_map_base;
  for (int round = 0; round < kRounds; ++round) {
    result.T_map_base = solver.Solve(result.T_map_base, round < kRobustRounds);
    solver.Classify(result.T_map_base, &result);
    constexpr int kFewestForAPose = 3;
    if (result.inliers < kFewestForAPose) break;
  }
  result.information = solver.Linearize(result.T_map_base, true, true).H;
  return result;
}

}  // namespace planar_vslam
