#pragma once
// How uncertain a wheel-odometry increment is, by one of two models.
//
// arc_length. Rate-independent: variances grow with distance and turn, not with the number of readings (estimation: a
// random walk in arc length). For an increment of length d (m) and turn dphi (rad):
//   sigma_x^2   = along_per_sqrt_meter^2  d + q_x
//   sigma_y^2   = across_per_sqrt_meter^2 d + across_per_sqrt_radian^2 |dphi| + q_y
//   sigma_phi^2 = heading_per_sqrt_meter^2 d + heading_per_sqrt_radian^2 |dphi| + q_phi
//
// amcl. The alphas of AMCL's diff model, for who has them (Thrun, Burgard, Fox, Probabilistic Robotics, 5.4). A motion
// is a turn rot1 = atan2(dy, dx), a way trans and a turn rot2 = dphi - rot1, each with a variance of its own; under 1
// cm of way rot1 is 0. Driving backwards is no turn: beyond pi/2, rot1 is counted from behind and trans is negative.
//   s_rot1^2  = alpha1 rot1^2 + alpha2 trans^2
//   s_trans^2 = alpha3 trans^2 + alpha4 (rot1^2 + rot2^2)
//   s_rot2^2  = alpha1 rot2^2 + alpha2 trans^2
//   Sigma = G diag(s_rot1^2, s_trans^2, s_rot2^2) G^T + diag(q_x, q_y, q_phi)
//   G = d(dx, dy, dphi)/d(rot1, trans, rot2) = [-trans sin rot1, cos rot1, 0; trans cos rot1, sin rot1, 0; 1, 0, 1]
// Its variances are quadratic in the motion, so a motion cut in n has an n-th of them: they are for the motion between
// two keyframes as a whole (OverWholeMotion in preintegration.h), not for readings. Trap: AMCL's legacy `diff` and
// `omni` hand these variances to the sampler as standard deviations (`diff-corrected` and `omni-corrected` do not);
// alphas tuned with those are not these.
//
// The floors q are per preintegrated interval, not per reading, so that standing still never claims certainty.
#include <Eigen/Core>
#include <string>
#include <vector>

#include "planar_vslam/geometry/rigid2.h"

namespace planar_vslam {

enum class OdometryNoiseModel { kArcLength, kAmcl };
// What to do with the covariance an odometry message carries (message_covariance.h).
enum class MessageCovarianceUse { kAuto, kNever };

struct OdometryNoise {
  OdometryNoiseModel model = OdometryNoiseModel::kArcLength;
  MessageCovarianceUse message_covariance = MessageCovarianceUse::kAuto;  // auto: instead of the model where it is real
  double along_per_sqrt_meter = 0.01;                                     // m / sqrt(m)
  double across_per_sqrt_meter = 0.01;                     // m / sqrt(m); an omnidirectional base slips both ways
  double across_per_sqrt_radian = 0.003;                   // m / sqrt(rad)
  double heading_per_sqrt_meter = DegreesToRadians(0.25);  // rad / sqrt(m)
  double heading_per_sqrt_radian = 0.01;                   // rad / sqrt(rad)
  // AMCL's defaults: generous, for a robot about which nothing is known.
  double amcl_alpha1 = 0.2;                      // rad^2 / rad^2, of a turn by turning
  double amcl_alpha2 = 0.2;                      // rad^2 / m^2, of a turn by driving
  double amcl_alpha3 = 0.2;                      // m^2 / m^2, of the way by driving
  double amcl_alpha4 = 0.2;                      // m^2 / rad^2, of the way by turning
  double position_floor = 0.002;                 // m, q_x = q_y = position_floor^2
  double heading_floor = DegreesToRadians(0.1);  // rad, q_phi
  // What the floor lets the base do between two poses in the directions odometry does not measure.
  double height_per_sqrt_meter = 0.005;                // m / sqrt(m)
  double height_floor = 0.005;                         // m
  double tilt_per_sqrt_meter = DegreesToRadians(0.2);  // rad / sqrt(m), roll and pitch each
  double tilt_floor = DegreesToRadians(0.3);           // rad: sway and joint backlash

  std::vector<std::string> Problems() const;
};

// Covariance of one increment by the model, expressed in its starting frame, tangent [x, y, angle], without the floors.
Eigen::Matrix3d IncrementCovariance(const OdometryNoise& noise, const Rigid2& increment);

}  // namespace planar_vslam
