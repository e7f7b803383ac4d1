#include "planar_vslam/geometry/rigid3.h"

#include <cmath>

namespace planar_vslam {

namespace {

// Below this squared angle (rad^2) the four-term series below are exact to about 1e-15, while the closed forms lose
// up to eight digits to cancellation.
constexpr double kSeriesAngleSquared = 1e-2;

// c0 + c1 x + c2 x^2 + c3 x^3, x the squared angle.
double Series(double x, double c0, double c1, double c2, double c3) { return c0 + x * (c1 + x * (c2 + x * c3)); }

// (1 - cos t) / t^2
double OneMinusCosine(double squared) {
  if (squared < kSeriesAngleSquared) return Series(squared, 1.0 / 2, -1.0 / 24, 1.0 / 720, -1.0 / 40320);
  const double half_sine = std::sin(0.5 * std::sqrt(squared));
  return 2.0 * half_sine * half_sine / squared;
}

// (t - sin t) / t^3
double AngleMinusSine(double squared) {
  if (squared < kSeriesAngleSquared) return Series(squared, 1.0 / 6, -1.0 / 120, 1.0 / 5040, -1.0 / 362880);
  const double angle = std::sqrt(squared);
  return (angle - std::sin(angle)) / (squared * angle);
}

// (t^2 + 2 cos t - 2) / (2 t^4)
double FourthOrder(double squared) {
  if (squared < kSeriesAngleSquared) return Series(squared, 1.0 / 24, -1.0 / 720, 1.0 / 40320, -1.0 / 3628800);
  return (squared + 2.0 * std::cos(std::sqrt(squared)) - 2.0) / (2.0 * squared * squared);
}

// (2 t - 3 sin t + t cos t) / (2 t^5)
double FifthOrder(double squared) {
  if (squared < kSeriesAngleSquared) return Series(squared, 1.0 / 120, -1.0 / 2520, 1.0 / 120960, -1.0 / 9979200);
  const double angle = std::sqrt(squared);
  return (2.0 * angle - 3.0 * std::sin(angle) + angle * std::cos(angle)) / (2.0 * squared * squared * angle);
}

// (1 - (t / 2) cot(t / 2)) / t^2, finite up to t < 2 pi
double InverseSecondOrder(double squared) {
  if (squared < kSeriesAngleSquared) return Series(squared, 1.0 / 12, 1.0 / 720, 1.0 / 30240, 1.0 / 1209600);
  const double half = 0.5 * std::sqrt(squared);
  return (1.0 - half * std::cos(half) / std::sin(half)) / squared;
}

Eigen::Matrix3d LeftJacobianSo3(const Eigen::Vector3d& phi) { return RightJacobianSo3(-phi); }
Eigen::Matrix3d LeftJacobianInverseSo3(const Eigen::Vector3d& phi) { return RightJacobianInverseSo3(-phi); }

// Barfoot eq. 7.86: the translation-rotation block of the left Jacobian of SE(3).
Eigen::Matrix3d LeftJacobianCoupling(const Eigen::Vector3d& rho, const Eigen::Vector3d& phi) {
  const double squared = phi.squaredNorm();
  const Eigen::Matrix3d P = Skew(phi);
  const Eigen::Matrix3d R = Skew(rho);
  const Eigen::Matrix3d PR = P * R;
  const Eigen::Matrix3d RP = R * P;
  const Eigen::Matrix3d PRP = PR * P;
  return 0.5 * R + AngleMinusSine(squared) * (PR + RP + PRP) + FourthOrder(squared) * (P * PR + RP * P - 3.0 * PRP) +
         FifthOrder(squared) * (PRP * P + P * PRP);
}

}  // namespace

Eigen::Matrix3d Skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

Eigen::Quaterniond ExpSo3(const Eigen::Vector3d& phi) {
  const double squared = phi.squaredNorm();
  const double half = 0.5 * std::sqrt(squared);
  // sin(t / 2) / t
  const double factor = squared < kSeriesAngleSquared ? Series(squared, 1.0 / 2, -1.0 / 48, 1.0 / 3840, -1.0 / 645120)
                                                      : std::sin(half) / (2.0 * half);
  return Eigen::Quaterniond(std::cos(half), factor * phi.x(), factor * phi.y(), factor * phi.z()).normalized();
}

Eigen::Vector3d LogSo3(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;  // q and -q are one rotation: take the shorter way round
  const double cosine = sign * q.w();
  const double sine = q.vec().norm();
  constexpr double kSmallSine = 1e-5;  // t / sin(t / 2) below it: the next term is under 1e-20
  const double factor = sine < kSmallSine ? 2.0 / cosine * (1.0 - sine * sine / (3.0 * cosine * cosine))
                                          : 2.0 * std::atan2(sine, cosine) / sine;
  return sign * factor * q.vec();
}

Eigen::Matrix3d RightJacobianSo3(const Eigen::Vector3d& phi) {
  const double squared = phi.squaredNorm();
  const Eigen::Matrix3d P = Skew(phi);
  return Eigen::Matrix3d::Identity() - OneMinusCosine(squared) * P + AngleMinusSine(squared) * P * P;
}

Eigen::Matrix3d RightJacobianInverseSo3(const Eigen::Vector3d& phi) {
  const Eigen::Matrix3d P = Skew(phi);
  return Eigen::Matrix3d::Identity() + 0.5 * P + InverseSecondOrder(phi.squaredNorm()) * P * P;
}

Rigid3 ExpSe3(const Vector6d& xi) {
  const Eigen::Vector3d phi = xi.tail<3>();
  return {ExpSo3(phi), Eigen::Vector3d(LeftJacobianSo3(phi) * xi.head<3>())};
}

Vector6d LogSe3(const Rigid3& T) {
  const Eigen::Vector3d phi = LogSo3(T.rotation);
  Vector6d xi;
  xi << LeftJacobianInverseSo3(phi) * T.translation, phi;
  return xi;
}

Matrix6d AdjointSe3(const Rigid3& T) {
  const Eigen::Matrix3d R = T.R();
  Matrix6d adjoint;
  adjoint << R, Skew(T.translation) * R, Eigen::Matrix3d::Zero(), R;
  return adjoint;
}

Matrix6d RightJacobianInverseSe3(const Vector6d& xi) {
  // The right Jacobian is the left one at -xi; its block inverse follows from the inverse of the rotation block.
  const Eigen::Vector3d rho = xi.head<3>();
  const Eigen::Vector3d phi = xi.tail<3>();
  const Eigen::Matrix3d inverse = RightJacobianInverseSo3(phi);
  Matrix6d jacobian;
  jacobian << inverse, -inverse * LeftJacobianCoupling(-rho, -phi) * inverse, Eigen::Matrix3d::Zero(), inverse;
  return jacobian;
}

Rigid3 Interpolate(const Rigid3& T_a, const Rigid3& T_b, double fraction) {
  return T_a * ExpSe3(fraction * LogSe3(T_a.Inverse() * T_b));
}

Rigid3 Embed3(const Rigid2& T) {
  return {Eigen::Quaterniond(std::cos(0.5 * T.angle), 0.0, 0.0, std::sin(0.5 * T.angle)),
          Eigen::Vector3d(T.translation.x(), T.translation.y(), 0.0)};
}

Rigid2 ProjectToPlane(const Rigid3& T) {
  const Eigen::Vector3d heading = T.rotation * Eigen::Vector3d::UnitX();
  return {T.translation.x(), T.translation.y(), std::atan2(heading.y(), heading.x())};
}

}  // namespace planar_vslam
