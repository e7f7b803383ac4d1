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

#include "planar_vslam/geometry/option_fields.h"
#include "planar_vslam/geometry/rigid2.h"

namespace planar_vslam {

enum class OdometryNoiseModel { kArcLength, kAmcl };
// What to do with the covariance an odometry message carries (message_covariance.h).
enum class MessageCovarianceUse { kAuto, kNever };

struct OdometryNoise {
  OdometryNoiseModel model = OdometryNoiseModel::kArcLength;
  MessageCovarianceUse message_covariance = MessageCovarianceUse::kAuto;
  double along_per_sqrt_meter = 0.01;
  double across_per_sqrt_meter = 0.01;  // an omnidirectional base slips both ways
  double across_per_sqrt_radian = 0.003;
  double heading_per_sqrt_meter = DegreesToRadians(0.25);
  double heading_per_sqrt_radian = 0.01;
  // AMCL's defaults: generous, for a robot about which nothing is known.
  double amcl_alpha1 = 0.2;
  double amcl_alpha2 = 0.2;
  double amcl_alpha3 = 0.2;
  double amcl_alpha4 = 0.2;
  double position_floor = 0.002;                 // q_x = q_y = position_floor^2
  double heading_floor = DegreesToRadians(0.1);  // q_phi = heading_floor^2
  // What the floor lets the base do between two poses in the directions odometry does not measure.
  double height_per_sqrt_meter = 0.005;
  double height_floor = 0.005;
  double tilt_per_sqrt_meter = DegreesToRadians(0.2);
  double tilt_floor = DegreesToRadians(0.3);

  // A rate may be zero (an error source switched off); a floor may not, or standing still would claim certainty.
  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    constexpr Unit kPerRootMeter{"m / sqrt(m)"}, kPerRootRadian{"m / sqrt(rad)"}, kTurnPerRootRadian{"rad / sqrt(rad)"};
    constexpr Unit kTurnPerRootMeter{"deg / sqrt(m)", DegreesToRadians(1.0)};
    constexpr Bound kRate = bound::AtLeast(0.0), kFloor = bound::Positive();
    v("model", o.model, {{"arc_length", OdometryNoiseModel::kArcLength}, {"amcl", OdometryNoiseModel::kAmcl}},
      "arc_length (the rates below) or amcl (its alphas)");
    v("message_covariance", o.message_covariance,
      {{"auto", MessageCovarianceUse::kAuto}, {"never", MessageCovarianceUse::kNever}},
      "auto: instead of the model where messages carry a real one; or never");
    v("along_per_sqrt_meter", o.along_per_sqrt_meter, kPerRootMeter, kRate, "forwards", Origin::kFitted);
    v("across_per_sqrt_meter", o.across_per_sqrt_meter, kPerRootMeter, kRate, "sideways", Origin::kFitted);
    v("across_per_sqrt_radian", o.across_per_sqrt_radian, kPerRootRadian, kRate, "sideways while turning",
      Origin::kFitted);
    v("heading_per_sqrt_meter_deg", o.heading_per_sqrt_meter, kTurnPerRootMeter, kRate, "", Origin::kFitted);
    v("heading_per_sqrt_radian", o.heading_per_sqrt_radian, kTurnPerRootRadian, kRate, "", Origin::kFitted);
    v("amcl_alpha1", o.amcl_alpha1, Unit{"rad^2 / rad^2"}, kRate, "variance of a turn by turning");
    v("amcl_alpha2", o.amcl_alpha2, Unit{"rad^2 / m^2"}, kRate, "of a turn by driving");
    v("amcl_alpha3", o.amcl_alpha3, Unit{"m^2 / m^2"}, kRate, "of the way by driving");
    v("amcl_alpha4", o.amcl_alpha4, Unit{"m^2 / rad^2"}, kRate, "of the way by turning");
    v("position_floor", o.position_floor, unit::kMeters, kFloor, "of any interval");
    v("heading_floor_deg", o.heading_floor, unit::kDegrees, kFloor, "of any interval");
    v("height_per_sqrt_meter", o.height_per_sqrt_meter, kPerRootMeter, kRate, "what the floor's height may change by",
      Origin::kFitted);
    v("height_floor", o.height_floor, unit::kMeters, kFloor, "of any interval");
    v("tilt_per_sqrt_meter_deg", o.tilt_per_sqrt_meter, kTurnPerRootMeter, kRate, "roll and pitch each",
      Origin::kFitted);
    v("tilt_floor_deg", o.tilt_floor, unit::kDegrees, kFloor, "sway and joint backlash");
  }
  std::vector<std::string> Problems() const { return ProblemsOf(*this); }
};

// Covariance of one increment by the model, expressed in its starting frame, tangent [x, y, angle], without the floors.
Eigen::Matrix3d IncrementCovariance(const OdometryNoise& noise, const Rigid2& increment);

}  // namespace planar_vslam
