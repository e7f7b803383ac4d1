#pragma once
// Wheel-odometry increments between two instants summed into one SE(2) measurement with covariance.
// For increments (dr_k, dphi_k) in the frame at k, starting from r = 0, phi = 0, Sigma = 0:
//   r <- r + R(phi) dr_k,  phi <- phi + dphi_k
//   Sigma <- A Sigma A^T + B Q_k B^T,  A = [I, R(phi) J dr_k; 0, 1],  B = diag(R(phi), 1),  J = [0 -1; 1 0]
// (Zheng and Liu, SE2LAM, 2018). Covariances here are of (r, phi) with r in the frame of the start, as in those
// equations; `heading_floor` and `position_floor` are added once by CovarianceWithFloor().
#include <Eigen/Core>
#include <vector>

#include "planar_vslam/geometry/rigid3.h"
#include "planar_vslam/planar/odometry_noise.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

struct PlanarMotion {
  Rigid2 T_i_j;                                          // pose of the base at j in the base at i
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // of [x, y, angle], frame i, without floors
  double distance = 0.0;                                 // m, path length
  double turn = 0.0;                                     // rad, sum of |dphi|
  double seconds = 0.0;                                  // time spanned
  bool modelled = false;  // part of the covariance is from the noise model, not from messages (message_covariance.h)
};

// `readings` in time order, at least one. One reading gives the identity with zero covariance. An increment whose
// reading carries a covariance has that, if the options let it, else the model's.
PlanarMotion Preintegrate(const std::vector<OdometryReading>& readings, const OdometryNoise& noise);

// With the arc-length model the motion as it is. With the AMCL model, whose variances are for whole motions, its
// covariance is that of the motion from end to end: for what becomes the link between two keyframes, once, when the
// keyframe is made. From then on links are composed as any. What the way there did (forth and back) does not count.
PlanarMotion OverWholeMotion(PlanarMotion odometry, const OdometryNoise& noise);

// i->j then j->k, as one i->k measurement. Used when keyframe j is culled. Associative up to rounding.
PlanarMotion Compose(const PlanarMotion& ij, const PlanarMotion& jk);

// The measurement in which the wheels slipped and missed the motion `slip` (right tangent [x, y, angle] at j): its
// variances grow by the square of what was missed, for vision's word on how much that was is no measurement of theirs.
PlanarMotion Inflate(PlanarMotion odometry, const Eigen::Vector3d& slip);

// How much noisier the wheels are than said of them: standard deviations, as multiples.
struct WheelNoise {
  double way = 1.0, turn = 1.0;
};
PlanarMotion Noisier(PlanarMotion odometry, const WheelNoise& noise);

// What any motion, however short, is off by at least: standard deviations of the one who measured it.
struct MotionFloor {
  double position = 0.002;                 // m, x and y each
  double heading = DegreesToRadians(0.1);  // rad
};

// The covariance with the floors added: always positive definite.
Eigen::Matrix3d CovarianceWithFloor(const PlanarMotion& motion, const MotionFloor& floor);
// The same of what the wheels measured.
Eigen::Matrix3d CovarianceWithFloor(const PlanarMotion& odometry, const OdometryNoise& noise);

// Covariance of T_i_j lifted to SE(3), tangent [translation, rotation] of a right perturbation at j:
// x, y, yaw from `planar` ([x, y, angle], frame i; rotated into frame j), z, roll, pitch from the floor's smoothness.
// Positive definite where `planar` is.
Matrix6d LiftedCovariance(const PlanarMotion& motion, const Eigen::Matrix3d& planar, const OdometryNoise& noise);

// The same of what the wheels measured: their floors are added. Always positive definite.
Matrix6d LiftedCovariance(const PlanarMotion& odometry, const OdometryNoise& noise);

// Upper triangular S with S^T S = covariance^-1, so that |S e|^2 = e^T covariance^-1 e.
Matrix6d SquareRootInformation(const Matrix6d& covariance);

}  // namespace planar_vslam
