#include "schur_solver.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "planar_vslam/geometry/tangent_parts.h"
#include "planar_vslam/optimize/reprojection_factor.h"
#include "planar_vslam/planar/relative_pose_factor.h"

namespace planar_vslam {
namespace {

using Matrix36 = Eigen::Matrix<double, 3, 6, Eigen::RowMajor>;
constexpr int kNoSlot = -1;
constexpr double kLeastCurvature = 1e-6;  // of H's diagonal, for damping: nothing may be known of a direction

struct Loss {
  double cost;    // rho(s) / 2
  double weight;  // rho'(s)
};
Loss Huber(double squared, double squared_limit) {
  if (squared <= squared_limit) return {0.5 * squared, 1.0};
  const double ratio = std::sqrt(squared_limit / squared);
  return {0.5 * (2.0 * ratio * squared - squared_limit), ratio};
}
Loss Cauchy(double squared, double scale) {
  const double c = scale * scale, sum = 1.0 + squared / c;
  return {0.5 * c * std::log(sum), 1.0 / sum};
}

// Rows (A_i x v): the product A [v]x.
Eigen::Matrix3d TimesSkew(const Eigen::Matrix3d& A, const Eigen::Vector3d& v) {
  Eigen::Matrix3d product;
  product.col(0) = A.col(1) * v.z() - A.col(2) * v.y();
  product.col(1) = A.col(2) * v.x() - A.col(0) * v.z();
  product.col(2) = A.col(0) * v.y() - A.col(1) * v.x();
  return product;
}

// block -= U_a^T U_c, of a matrix with columns of `stride`.
void SubtractProduct(const Matrix36& U_a, const Matrix36& U_c, double* block, Eigen::Index stride) {
  for (int column = 0; column < 6; ++column, block += stride) {
    const double c0 = U_c(0, column), c1 = U_c(1, column), c2 = U_c(2, column);
    for (int row = 0; row < 6; ++row) block[row] -= U_a(0, row) * c0 + U_a(1, row) * c1 + U_a(2, row) * c2;
  }
}

// An observation that takes part, where it is evaluated.
struct Pixel {
  Eigen::Vector2d pixel;
  double inverse_sigma;
  std::uint32_t pose;
  std::uint32_t source;  // index in the problem

  Eigen::Vector3d p_camera = Eigen::Vector3d::Zero();  // at the state evaluated last
  Eigen::Vector2d e = Eigen::Vector2d::Zero();
  double weight = 0.0;  // 0 behind the camera
};

// What an observation from a free pose leaves for the elimination of its point.
struct FreeView {
  Eigen::Matrix3d A;
  Eigen::Vector3d v;
  int slot;
};

struct PointSystem {
  std::size_t pixels_begin = 0, pixels_end = 0;
  std::size_t views_begin = 0, views_end = 0;
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  Eigen::Matrix3d K_inverse = Eigen::Matrix3d::Zero();  // of the damped H; zero where it has none
};

struct Camera {
  Eigen::Matrix3d R;  // camera <- map
  Eigen::Vector3d t;
};

class SchurSolver {
 public:
  explicit SchurSolver(BundleProblem* problem) : p_(*problem) {
    slots_.assign(p_.poses.size(), kNoSlot);
    for (std::size_t i = 0; i < p_.poses.size(); ++i) {
      if (p_.poses[i].freedom == PoseFreedom::kFixed) continue;
      slots_[i] = static_cast<int>(poses_of_slots_.size());
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

  BundleOutcome Solve(const BundleLimits& limits);

 private:
  bool IsFinite() const;
  double Evaluate();
  double EvaluatePixels();
  double EvaluateMotions() const;
  void Linearize();
  void LinearizePoint(PointSystem* point, const Eigen::Vector3d& p_map);
  void AddView(const Pixel& pixel, const Eigen::Matrix3d& A, const Eigen::Vector3d& g, const Eigen::Vector3d& p_map);
  void LinearizeMotions();
  void LinearizeFloor();
  void KeepPlanar(Eigen::MatrixXd* H, Eigen::VectorXd* b) const;
  bool Step(double lambda);
  void Eliminate(PointSystem* point, double lambda);
  void BackSubstitute();
  double PredictedDecrease(double lambda) const;
  void Move();

  BundleProblem& p_;
  std::vector<int> slots_;  // per pose, its place among the free ones
  std::vector<std::size_t> poses_of_slots_;
  Eigen::Index size_ = 0;  // of the reduced system
  std::vector<Pixel> pixels_;
  std::vector<PointSystem> points_;
  std::vector<FreeView> views_;
  std::vector<Matrix36> U_;  // of the views of one point
  std::vector<Camera> cameras_;
  Eigen::MatrixXd H_, S_;  // of the poses, lower triangles: before and after elimination
  Eigen::VectorXd b_, r_;
  Eigen::VectorXd pose_step_;
  std::vector<Eigen::Vector3d> point_steps_;
};

bool SchurSolver::IsFinite() const {
  return std::all_of(p_.points.begin(), p_.points.end(), [](const auto& point) { return point.p_map.allFinite(); }) &&
         std::all_of(p_.poses.begin(), p_.poses.end(), [](const auto& pose) {
           return pose.T_map_base.translation.allFinite() && pose.T_map_base.rotation.coeffs().allFinite();
         });
}

double SchurSolver::Evaluate() {
  cameras_.clear();
  for (const BundlePose& pose : p_.poses) {
    const Rigid3 T_camera_map = (pose.T_map_base * pose.T_base_camera).Inverse();
    cameras_.push_back({T_camera_map.R(), T_camera_map.translation});
  }
  double cost = EvaluatePixels() + EvaluateMotions();
  for (const std::size_t i : poses_of_slots_) {
    if (!p_.has_floor_prior(p_.poses[i])) continue;
    cost += 0.5 * PlanarPriorResidual(p_.poses[i].T_map_base, p_.planar.sigma_height, p_.planar.sigma_tilt, nullptr)
                      .squaredNorm();
  }
  for (const std::size_t l : p_.floor_points) {
    const double e = p_.points[l].p_map.z() / p_.planar.sigma_floor_point;
    cost += Cauchy(e * e, kFloorPointLoss).cost;
  }
  return cost;
}

double SchurSolver::EvaluatePixels() {
  double cost = 0.0;
  for (std::size_t l = 0; l < points_.size(); ++l) {
    const Eigen::Vector3d& p_map = p_.points[l].p_map;
    for (std::size_t i = points_[l].pixels_begin; i < points_[l].pixels_end; ++i) {
      Pixel& pixel = pixels_[i];
      const Camera& camera = cameras_[pixel.pose];
      pixel.p_camera.noalias() = camera.R * p_map + camera.t;
      pixel.weight = 0.0;
      if (!(pixel.p_camera.z() > kMinDepth)) continue;
      pixel.e = pixel.inverse_sigma * (p_.camera.ProjectUndistorted(pixel.p_camera) - pixel.pixel);
      if (!p_.whitening.empty()) pixel.e = (p_.whitening[pixel.source] * pixel.e).eval();
      const Loss loss = Huber(pixel.e.squaredNorm(), kPixelLossSquared);
      pixel.weight = loss.weight;
      cost += loss.cost;
    }
  }
  return cost;
}

double SchurSolver::EvaluateMotions() const {
  double cost = 0.0;
  for (const BundleMotion& m : p_.motions) {
    const Vector6d e = m.sqrt_information * RelativePoseResidual(p_.poses[m.i].T_map_base, p_.poses[m.j].T_map_base,
                                                                 m.T_i_j, nullptr, nullptr);
    cost += Cauchy(e(kPlanarRows).squaredNorm(), p_.options.odometry_loss).cost +
            Cauchy(e(kFloorRows).squaredNorm(), p_.options.tilt_loss).cost;
  }
  return cost;
}

void SchurSolver::Linearize() {
  H_.setZero(size_, size_);
  b_.setZero(size_);
  views_.clear();
  for (std::size_t l = 0; l < points_.size(); ++l) LinearizePoint(&points_[l], p_.points[l].p_map);
  for (const std::size_t l : p_.floor_points) {
    const double inverse_sigma = 1.0 / p_.planar.sigma_floor_point, e = p_.points[l].p_map.z() * inverse_sigma;
    const double weight = Cauchy(e * e, kFloorPointLoss).weight;
    points_[l].H(2, 2) += weight * inverse_sigma * inverse_sigma;
    points_[l].b.z() += weight * inverse_sigma * e;
  }
  LinearizeMotions();
  LinearizeFloor();
  KeepPlanar(&H_, &b_);
}

void SchurSolver::LinearizePoint(PointSystem* point, const Eigen::Vector3d& p_map) {
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

void SchurSolver::AddView(const Pixel& pixel, const Eigen::Matrix3d& A, const Eigen::Vector3d& g,
                          const Eigen::Vector3d& p_map) {
  const int slot = slots_[pixel.pose];
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

// Jacobians for right perturbations -> for steps in the axes of the map.
template <int Rows>
Eigen::Matrix<double, Rows, 6> InMapAxes(const Eigen::Matrix<double, Rows, 6>& J, const Rigid3& T_map_base) {
  const Eigen::Matrix3d R_base_map = T_map_base.R().transpose();
  Eigen::Matrix<double, Rows, 6> turned;
  turned.template leftCols<3>() = J.template leftCols<3>() * R_base_map;
  turned.template rightCols<3>() = J.template rightCols<3>() * R_base_map;
  return turned;
}

void SchurSolver::LinearizeMotions() {
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

void SchurSolver::LinearizeFloor() {
  for (const std::size_t i : poses_of_slots_) {
    if (!p_.has_floor_prior(p_.poses[i])) continue;
    const Rigid3& T_map_base = p_.poses[i].T_map_base;
    Eigen::Matrix<double, 3, 6> J;
    const Eigen::Vector3d e = PlanarPriorResidual(T_map_base, p_.planar.sigma_height, p_.planar.sigma_tilt, &J);
    J = InMapAxes<3>(J, T_map_base);
    const Eigen::Index at = 6 * slots_[i];
    H_.block<6, 6>(at, at) += J.transpose() * J;
    b_.segment<6>(at) += J.transpose() * e;
  }
}

// Planar poses do not move along z, roll and pitch.
void SchurSolver::KeepPlanar(Eigen::MatrixXd* H, Eigen::VectorXd* b) const {
  for (const std::size_t i : poses_of_slots_) {
    if (p_.poses[i].freedom != PoseFreedom::kFloor) continue;
    for (const int row : kFloorRows) {
      const Eigen::Index at = 6 * slots_[i] + row;
      H->row(at).setZero();
      H->col(at).setZero();
      (*H)(at, at) = 1.0;
      (*b)(at) = 0.0;
    }
  }
}

// Solves the damped equations. False where they have no solution.
bool SchurSolver::Step(double lambda) {
  S_ = H_;
  S_.diagonal() += lambda * H_.diagonal().cwiseMax(kLeastCurvature);
  r_ = -b_;
  for (PointSystem& point : points_) Eliminate(&point, lambda);
  KeepPlanar(&S_, &r_);
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(S_);
  if (cholesky.info() != Eigen::Success) return false;
  pose_step_ = cholesky.solve(r_);
  if (!pose_step_.allFinite()) return false;
  BackSubstitute();
  return true;
}

void SchurSolver::Eliminate(PointSystem* point, double lambda) {
  Eigen::Matrix3d damped = point->H;
  damped.diagonal() += lambda * point->H.diagonal().cwiseMax(kLeastCurvature);
  const Eigen::LLT<Eigen::Matrix3d> cholesky(damped);
  if (cholesky.info() != Eigen::Success) {
    point->K_inverse.setZero();
    return;
  }
  point->K_inverse = cholesky.matrixL().solve(Eigen::Matrix3d::Identity());
  const Eigen::Vector3d u = point->K_inverse * point->b;
  U_.resize(point->views_end - point->views_begin);
  for (std::size_t a = 0; a < U_.size(); ++a) {
    const FreeView& view = views_[point->views_begin + a];
    const Eigen::Matrix3d X = point->K_inverse * view.A;
    U_[a].leftCols<3>() = -X;
    U_[a].rightCols<3>() = TimesSkew(X, view.v);
    r_.segment<6>(6 * view.slot).noalias() += U_[a].transpose() * u;
    for (std::size_t c = 0; c <= a; ++c) {
      SubtractProduct(U_[a], U_[c], &S_(6 * view.slot, 6 * views_[point->views_begin + c].slot), size_);
    }
  }
}

void SchurSolver::BackSubstitute() {
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
double SchurSolver::PredictedDecrease(double lambda) const {
  double sum = pose_step_.dot(lambda * H_.diagonal().cwiseMax(kLeastCurvature).cwiseProduct(pose_step_) - b_);
  for (std::size_t l = 0; l < points_.size(); ++l) {
    const Eigen::Vector3d& d = point_steps_[l];
    sum += d.dot(lambda * points_[l].H.diagonal().cwiseMax(kLeastCurvature).cwiseProduct(d) - points_[l].b);
  }
  return 0.5 * sum;
}

void SchurSolver::Move() {
  for (std::size_t slot = 0; slot < poses_of_slots_.size(); ++slot) {
    Rigid3& T = p_.poses[poses_of_slots_[slot]].T_map_base;
    const Vector6d d = pose_step_.segment<6>(6 * static_cast<Eigen::Index>(slot));
    T = {(ExpSo3(d.tail<3>()) * T.rotation).normalized(), Eigen::Vector3d(T.translation + d.head<3>())};
  }
  for (std::size_t l = 0; l < points_.size(); ++l) p_.points[l].p_map += point_steps_[l];
}

BundleOutcome SchurSolver::Solve(const BundleLimits& limits) {
  constexpr double kFirstLambda = 1e-4, kLargestLambda = 1e12;
  constexpr double kLeastRatio = 1e-3;  // of true to predicted decrease
  BundleOutcome outcome;
  outcome.iterations = 1;
  double residuals_ms = 0.0, jacobians_ms = 0.0, step_ms = 0.0;
  const auto timed = [](double* ms, auto&& work) {
    const Stopwatch watch;
    auto value = work();
    *ms += watch.Milliseconds();
    return value;
  };
  const auto linearize = [&] {
    timed(&jacobians_ms, [&] {
      Linearize();
      return true;
    });
  };
  double cost = timed(&residuals_ms, [&] { return Evaluate(); });
  outcome.initial_cost = outcome.final_cost = cost;
  if (!IsFinite() || !std::isfinite(cost)) {
    outcome.message = "the state is not finite";
    return outcome;
  }
  outcome.usable = true;
  outcome.message = "iterations used up";
  linearize();
  double lambda = kFirstLambda, growth = 2.0;
  for (; outcome.iterations <= limits.max_iterations; ++outcome.iterations) {
    const bool solved = timed(&step_ms, [&] { return Step(lambda); });
    bool accepted = false;
    if (solved) {
      const std::vector<BundlePose> poses = p_.poses;
      const std::vector<BundlePoint> points = p_.points;
      Move();
      const double candidate = timed(&residuals_ms, [&] { return Evaluate(); });
      const double ratio = (cost - candidate) / PredictedDecrease(lambda);
      accepted = std::isfinite(candidate) && candidate <= cost && (ratio > kLeastRatio || candidate == cost);
      if (accepted) {
        const double gain = cost - candidate;
        cost = candidate;
        const double x = 2.0 * ratio - 1.0;
        lambda *= std::max(1.0 / 3.0, 1.0 - x * x * x);
        growth = 2.0;
        if (gain <= limits.relative_gain * cost) {
          outcome.message = "gain below its limit";
          ++outcome.iterations;
          break;
        }
        if (outcome.iterations < limits.max_iterations) linearize();
      } else {
        p_.poses = poses;
        p_.points = points;
      }
    }
    if (!accepted) {
      lambda *= growth;
      growth *= 2.0;
      if (lambda > kLargestLambda) {
        outcome.message = "no step lowers the cost";
        break;
      }
    }
  }
  outcome.final_cost = cost;
  outcome.times = {
      {"bundle.residuals", residuals_ms}, {"bundle.jacobians", jacobians_ms}, {"bundle.linear_solver", step_ms}};
  return outcome;
}

}  // namespace

BundleOutcome SolveWithSchur(BundleProblem* problem, const BundleLimits& limits) {
  return SchurSolver(problem).Solve(limits);
}

}  // namespace planar_vslam
