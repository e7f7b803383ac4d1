#include "planar_vslam/planar/preintegration.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "planar_vslam/geometry/check.h"

namespace planar_vslam {

namespace {

double Square(double value) { return value * value; }

PlanarMotion SingleIncrement(const OdometryReading& from, const OdometryReading& to, const OdometryNoise& noise) {
  PV_CHECK(from.stamp <= to.stamp,
           "readings out of order: " << from.stamp.nanoseconds << " ns before " << to.stamp.nanoseconds << " ns");
  PlanarMotion increment;
  increment.T_i_j = from.T_odom_base.Inverse() * to.T_odom_base;
  const bool measured = to.covariance_rate.has_value() && noise.message_covariance == MessageCovarianceUse::kAuto;
  increment.distance = increment.T_i_j.translation.norm();
  increment.turn = std::abs(increment.T_i_j.angle);
  increment.seconds = SecondsBetween(from.stamp, to.stamp);
  increment.covariance =
      measured ? Eigen::Matrix3d(increment.seconds * *to.covariance_rate) : IncrementCovariance(noise, increment.T_i_j);
  increment.modelled = !measured;
  return increment;
}

}  // namespace

PlanarMotion Preintegrate(const std::vector<OdometryReading>& readings, const OdometryNoise& noise) {
  PV_CHECK(!readings.empty(), "preintegration needs at least one reading");
  PlanarMotion sum;
  for (std::size_t k = 1; k < readings.size(); ++k) {
    sum = Compose(sum, SingleIncrement(readings[k - 1], readings[k], noise));
  }
  return OverWholeMotion(sum, noise);
}

PlanarMotion OverWholeMotion(PlanarMotion odometry, const OdometryNoise& noise) {
  if (noise.model == OdometryNoiseModel::kAmcl && odometry.modelled) {
    odometry.covariance = IncrementCovariance(noise, odometry.T_i_j);
  }
  return odometry;
}

PlanarMotion Compose(const PlanarMotion& ij, const PlanarMotion& jk) {
  const Eigen::Matrix2d R = ij.T_i_j.R();
  const Eigen::Vector2d r = R * jk.T_i_j.translation;
  Eigen::Matrix3d A = Eigen::Matrix3d::Identity();
  A(0, 2) = -r.y();  // J r: a heading error at j swings everything after it
  A(1, 2) = r.x();
  Eigen::Matrix3d B = Eigen::Matrix3d::Identity();
  B.topLeftCorner<2, 2>() = R;

  PlanarMotion ik;
  ik.T_i_j = ij.T_i_j * jk.T_i_j;
  ik.covariance = A * ij.covariance * A.transpose() + B * jk.covariance * B.transpose();
  ik.distance = ij.distance + jk.distance;
  ik.turn = ij.turn + jk.turn;
  ik.seconds = ij.seconds + jk.seconds;
  ik.modelled = ij.modelled || jk.modelled;
  return ik;
}

PlanarMotion Inflate(PlanarMotion odometry, const Eigen::Vector3d& slip) {
  const double missed = slip.head<2>().squaredNorm();  // whichever way the wheels point the next time
  odometry.covariance.diagonal() += Eigen::Vector3d(missed, missed, Square(slip.z()));
  return odometry;
}

PlanarMotion Noisier(PlanarMotion odometry, const WheelNoise& noise) {
  const Eigen::Vector3d factors(noise.way, noise.way, noise.turn);
  odometry.covariance = factors.asDiagonal() * odometry.covariance * factors.asDiagonal();
  return odometry;
}

Eigen::Matrix3d CovarianceWithFloor(const PlanarMotion& motion, const MotionFloor& floor) {
  Eigen::Matrix3d covariance = motion.covariance;
  covariance.diagonal() += Eigen::Vector3d(Square(floor.position), Square(floor.position), Square(floor.heading));
  return covariance;
}

Eigen::Matrix3d CovarianceWithFloor(const PlanarMotion& odometry, const OdometryNoise& noise) {
  return CovarianceWithFloor(odometry, MotionFloor{noise.position_floor, noise.heading_floor});
}

Matrix6d LiftedCovariance(const PlanarMotion& motion, const Eigen::Matrix3d& planar, const OdometryNoise& noise) {
  // A right perturbation at j moves r by R(phi) d_t, so d = B^T [dr, dphi].
  Eigen::Matrix3d B = Eigen::Matrix3d::Identity();
  B.topLeftCorner<2, 2>() = motion.T_i_j.R();
  const Eigen::Matrix3d at_j = B.transpose() * planar * B;

  const double height_variance = Square(noise.height_per_sqrt_meter) * motion.distance + Square(noise.height_floor);
  const double tilt_variance = Square(noise.tilt_per_sqrt_meter) * motion.distance + Square(noise.tilt_floor);
  Matrix6d covariance = Matrix6d::Zero();
  covariance.topLeftCorner<2, 2>() = at_j.topLeftCorner<2, 2>();
  covariance.block<2, 1>(0, 5) = at_j.block<2, 1>(0, 2);
  covariance.block<1, 2>(5, 0) = at_j.block<1, 2>(2, 0);
  covariance(5, 5) = at_j(2, 2);
  covariance(2, 2) = height_variance;
  covariance(3, 3) = tilt_variance;
  covariance(4, 4) = tilt_variance;
  return covariance;
}

Matrix6d LiftedCovariance(const PlanarMotion& odometry, const OdometryNoise& noise) {
  return LiftedCovariance(odometry, CovarianceWithFloor(odometry, noise), noise);
}

Matrix6d SquareRootInformation(const Matrix6d& covariance) {
  // With rows and columns reversed, Cholesky gives covariance = U U^T, U upper triangular; then S = U^-1.
  const Eigen::LLT<Matrix6d> reversed(covariance.reverse());
  const Matrix6d inverse = reversed.matrixL().solve(Matrix6d::Identity());
  PV_CHECK(reversed.info() == Eigen::Success && inverse.allFinite(),
           "covariance is not positive definite, diagonal " << covariance.diagonal().transpose());
  return inverse.reverse();
}

}  // namespace planar_vslam
