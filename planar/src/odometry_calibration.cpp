#include "planar_vslam/planar/odometry_calibration.h"

#include <algorithm>

#include "planar_vslam/geometry/check.h"
#include "planar_vslam/planar/pose_manifold.h"
#include "planar_vslam/planar/relative_pose_factor.h"

namespace planar_vslam {
namespace {

// An instant to a fraction of a nanosecond: derivatives by the time offset need that.
struct Instant {
  Timestamp origin;
  double seconds = 0.0;  // after origin

  double Since(Timestamp t) const { return SecondsBetween(t, origin) + seconds; }
};

// Index k of the interval [k, k + 1] that holds `t`; the first or last one beyond the ends.
std::size_t IntervalOf(const std::vector<OdometryReading>& readings, const Instant& t) {
  PV_CHECK(readings.size() >= 2, "velocity needs two readings");
  const auto after =
      std::upper_bound(readings.begin(), readings.end(), t,
                       [](const Instant& s, const OdometryReading& reading) { return s.Since(reading.stamp) < 0.0; });
  const auto index = static_cast<std::ptrdiff_t>(after - readings.begin()) - 1;
  return static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(index, 0, static_cast<std::ptrdiff_t>(readings.size()) - 2));
}

Eigen::Vector3d Velocity(const std::vector<OdometryReading>& readings, std::size_t interval) {
  const OdometryReading &from = readings[interval], &to = readings[interval + 1];
  const double seconds = SecondsBetween(from.stamp, to.stamp);
  if (!(seconds > 0.0)) return Eigen::Vector3d::Zero();
  return LogSe2(from.T_odom_base.Inverse() * to.T_odom_base) / seconds;
}

// Pose at `t`, on the constant twist of its interval.
Rigid2 PoseAt(const std::vector<OdometryReading>& readings, const Instant& t) {
  const std::size_t k = IntervalOf(readings, t);
  return readings[k].T_odom_base * ExpSe2(t.Since(readings[k].stamp) * Velocity(readings, k));
}

// Right tangent of the plane as one of space: x, y, heading.
Eigen::Matrix<double, 6, 3> LiftTangent() {
  Eigen::Matrix<double, 6, 3> lift = Eigen::Matrix<double, 6, 3>::Zero();
  lift(0, 0) = lift(1, 1) = lift(5, 2) = 1.0;
  return lift;
}

// Exp(xi + d) = Exp(xi) Exp(J d) to first order, for the short twists between readings: the series up to ad^3, the next
// term is below 1e-8 up to 0.03 rad.
Eigen::Matrix3d RightJacobianSe2(const Eigen::Vector3d& xi) {
  Eigen::Matrix3d ad = Eigen::Matrix3d::Zero();
  ad.row(0) << 0.0, -xi.z(), xi.y();
  ad.row(1) << xi.z(), 0.0, -xi.x();
  return Eigen::Matrix3d::Identity() - ad / 2.0 + ad * ad / 6.0 - ad * ad * ad / 24.0;
}

// Appends the corrected increment to a motion and to its derivative by the scale.
void Append(const Rigid2& increment, const Eigen::Vector3d& scale, CorrectedMotion* motion) {
  const Eigen::Vector3d twist = LogSe2(increment);
  const Eigen::Vector3d corrected = scale.cwiseProduct(twist);
  const Rigid2 T = ExpSe2(corrected);
  motion->T_i_j = motion->T_i_j * T;
  motion->by_scale = AdjointSe2(T.Inverse()) * motion->by_scale;
  motion->by_scale += RightJacobianSe2(corrected) * twist.asDiagonal();
}

// Weighted residual and Jacobians by the poses, which both factors share. Returns de/dn of a right perturbation of T~.
Eigen::Matrix<double, 6, 3> EvaluateMotion(const double* const* parameters, const Rigid2& T_i_j,
                                           const Matrix6d& sqrt_information, double* residuals, double** jacobians) {
  Matrix6d J_i, J_j;
  const Vector6d e = RelativePoseResidual(LoadPose(parameters[0]), LoadPose(parameters[1]), Embed3(T_i_j), &J_i, &J_j);
  Eigen::Map<Vector6d>(residuals).noalias() = sqrt_information * e;
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    const Matrix6d weighted = sqrt_information * J_i;
    Eigen::Map<PoseJacobianMap>(jacobians[0]).noalias() = weighted * PoseMinusJacobian(parameters[0]);
  }
  if (jacobians != nullptr && jacobians[1] != nullptr) {
    const Matrix6d weighted = sqrt_information * J_j;
    Eigen::Map<PoseJacobianMap>(jacobians[1]).noalias() = weighted * PoseMinusJacobian(parameters[1]);
  }
  return -sqrt_information * RightJacobianInverseSe3(-e) * LiftTangent();
}

}  // namespace

CorrectedMotion CorrectMotion(const std::vector<OdometryReading>& readings, Timestamp t_i, Timestamp t_j,
                              const OdometryCorrection& correction) {
  const Instant from{t_i, correction.time_offset}, to{t_j, correction.time_offset};
  CorrectedMotion motion;
  Rigid2 T_odom_last = PoseAt(readings, from);
  for (const OdometryReading& reading : readings) {
    if (from.Since(reading.stamp) >= 0.0 || to.Since(reading.stamp) <= 0.0) continue;
    Append(T_odom_last.Inverse() * reading.T_odom_base, correction.scale, &motion);
    T_odom_last = reading.T_odom_base;
  }
  Append(T_odom_last.Inverse() * PoseAt(readings, to), correction.scale, &motion);
  const Eigen::Vector3d v_i = correction.scale.cwiseProduct(Velocity(readings, IntervalOf(readings, from)));
  const Eigen::Vector3d v_j = correction.scale.cwiseProduct(Velocity(readings, IntervalOf(readings, to)));
  motion.by_time_offset = v_j - AdjointSe2(motion.T_i_j.Inverse()) * v_i;
  return motion;
}

OdometryReading OdometryCorrector::Correct(const OdometryReading& reading) {
  OdometryReading corrected{Correct(reading.stamp), reading.T_odom_base, reading.covariance_rate};
  plain_ = plain_ && correction_.scale == Eigen::Vector3d::Ones();
  if (plain_ || !started_) {
    T_corrected_last_ = reading.T_odom_base;
    started_ = true;
  } else {
    const Rigid2 increment = T_odom_last_.Inverse() * reading.T_odom_base;
    T_corrected_last_ = T_corrected_last_ * ExpSe2(correction_.scale.cwiseProduct(LogSe2(increment)));
  }
  T_odom_last_ = reading.T_odom_base;
  corrected.T_odom_base = T_corrected_last_;
  if (corrected.covariance_rate.has_value()) {
    *corrected.covariance_rate =
        correction_.scale.asDiagonal() * *reading.covariance_rate * correction_.scale.asDiagonal();
  }
  return corrected;
}

Timestamp OdometryCorrector::Correct(Timestamp stamp) const { return Shifted(stamp, -correction_.time_offset); }

bool OdometryCalibrationFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const OdometryCorrection correction{Eigen::Map<const Eigen::Vector3d>(parameters[2]), parameters[3][0]};
  const CorrectedMotion motion = CorrectMotion(readings_, t_i_, t_j_, correction);
  const Eigen::Matrix<double, 6, 3> by_motion =
      EvaluateMotion(parameters, motion.T_i_j, sqrt_information_, residuals, jacobians);
  if (jacobians != nullptr && jacobians[2] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 6, 3, Eigen::RowMajor>> J(jacobians[2]);
    J = by_motion * motion.by_scale;
  }
  if (jacobians != nullptr && jacobians[3] != nullptr) {
    Eigen::Map<Vector6d> J(jacobians[3]);
    J = by_motion * motion.by_time_offset;
  }
  return true;
}

bool DelayedMotionFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const double td = parameters[2][0];
  const auto driven = [&](const ImageInstant& image) {
    return PoseAt(image.around, {image.stamp, present_offset_}).Inverse() * PoseAt(image.around, {image.stamp, td});
  };
  const auto velocity = [&](const ImageInstant& image) {
    return Velocity(image.around, IntervalOf(image.around, {image.stamp, td}));
  };
  const Rigid2 T = driven(i_).Inverse() * T_i_j_ * driven(j_);
  const Eigen::Matrix<double, 6, 3> by_motion = EvaluateMotion(parameters, T, sqrt_information_, residuals, jacobians);
  if (jacobians != nullptr && jacobians[2] != nullptr) {
    Eigen::Map<Vector6d> J(jacobians[2]);
    J = by_motion * (velocity(j_) - AdjointSe2(T.Inverse()) * velocity(i_));
  }
  return true;
}

}  // namespace planar_vslam
