#pragma once
// The constants between camera, wheels and their clocks, and wheel odometry as a function of them.
//   The twist of each increment between readings is corrected,  xi <- c xi  (x, y, yaw each), and an image stamped t
//   was taken when odometry and laser read t + td.
// Motion between images i and j, with the increments xi_k between t_i + td and t_j + td, and its derivatives as right
// perturbations of T_i_j:
//   T <- T Exp(c xi_k),  D_c <- Ad(Exp(c xi_k)^-1) D_c + Jr(c xi_k) diag(xi_k),  D_td = v_j - Ad(T_i_j^-1) v_i
// with the corrected body velocities v at both ends.
// Factor, 6-D on SE(3) as in relative_pose_factor.h:  e = Log( T~_i_j(c, td)^-1 T_map_i^-1 T_map_j ). A right
// perturbation n of T~ moves it by  de/dn = -Jr^-1(-e),  as  Log(Exp(-n) E) = e - Jl^-1(e) n.
#include <ceres/ceres.h>

#include <utility>
#include <vector>

#include "planar_vslam/geometry/rigid3.h"
#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

struct OdometryCorrection {
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();  // c: x, y, yaw; multiplies what was read
  double time_offset = 0.0;                         // s, td: odometry's clock minus the camera's
};

struct CorrectedMotion {
  Rigid2 T_i_j;
  Eigen::Matrix3d by_scale = Eigen::Matrix3d::Zero();        // right tangent [x, y, angle] by c
  Eigen::Vector3d by_time_offset = Eigen::Vector3d::Zero();  // by td
};
// `readings` in time order. They reach from before t_i + td to after t_j + td; beyond their ends the base is taken to
// keep its velocity.
CorrectedMotion CorrectMotion(const std::vector<OdometryReading>& readings, Timestamp t_i, Timestamp t_j,
                              const OdometryCorrection& correction);

// The same readings as the corrected wheels would have given, with corrected stamps: what comes in from then on.
class OdometryCorrector {
 public:
  explicit OdometryCorrector(const OdometryCorrection& correction) : correction_(correction) {}
  OdometryReading Correct(const OdometryReading& reading);
  // From the next reading on; the corrected odometry goes on from where it is.
  void SetScale(const Eigen::Vector3d& scale) { correction_.scale = scale; }
  Timestamp Correct(Timestamp stamp) const;

 private:
  OdometryCorrection correction_;
  bool started_ = false;
  bool plain_ = true;  // nothing was corrected yet: readings keep their bits
  Rigid2 T_odom_last_, T_corrected_last_;
};

// Blocks: pose i (7), pose j (7), c (3), td (1). 6 residuals.
class OdometryCalibrationFactor final : public ceres::SizedCostFunction<6, 7, 7, 3, 1> {
 public:
  OdometryCalibrationFactor(std::vector<OdometryReading> readings, Timestamp t_i, Timestamp t_j,
                            const Matrix6d& sqrt_information)
      : readings_(std::move(readings)), t_i_(t_i), t_j_(t_j), sqrt_information_(sqrt_information) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  std::vector<OdometryReading> readings_;
  Timestamp t_i_, t_j_;
  Matrix6d sqrt_information_;
};

// An image on odometry's clock: the readings around it, and where they are read.
struct ImageInstant {
  std::vector<OdometryReading> around;  // in time order, at least two
  Timestamp stamp;                      // of the image
};

// A motion measured by another sensor on odometry's clock (the laser) between the bases at images i and j, under the
// offset td_0 that was taken for right:  T~_i_j(td) = D_i(td)^-1 T_i_j D_j(td),  D(td) what odometry drove from t +
// td_0 to t + td. By td, as a right perturbation:  v_j - Ad(T~_i_j^-1) v_i,  v the body velocities at t + td. Blocks:
// pose i (7), pose j (7), td (1). 6 residuals.
class DelayedMotionFactor final : public ceres::SizedCostFunction<6, 7, 7, 1> {
 public:
  DelayedMotionFactor(const Rigid2& T_i_j, ImageInstant i, ImageInstant j, double present_offset,
                      const Matrix6d& sqrt_information)
      : T_i_j_(T_i_j),
        i_(std::move(i)),
        j_(std::move(j)),
        present_offset_(present_offset),
        sqrt_information_(sqrt_information) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Rigid2 T_i_j_;
  ImageInstant i_, j_;
  double present_offset_;  // s
  Matrix6d sqrt_information_;
};

}  // namespace planar_vslam
