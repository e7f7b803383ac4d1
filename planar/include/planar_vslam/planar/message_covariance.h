#pragma once
// What the covariance an odometry message carries says about the motion since the message before.
// A message has two: of the pose, along the axes of the odometry frame, meant to be what accumulated since the start;
// and of the twist, along the axes of the base. Drivers fill in either, both, neither, or numbers that mean nothing:
// the same few matrices whatever the robot does. So a covariance has to earn belief.
//
// A matrix can be meant if its entries are finite, it is positive definite and no variance of x, y or yaw is a
// placeholder: at most 1e-9 (also zero; "exact") or at least 1e4 (1e6, 99999: "not measured").
//
// 1. The pose covariance P, if it can be meant now and before. With the step dr = p_k+1 - p_k in the odometry frame,
//      P_k+1 = A P_k A^T + B Q B^T,   A = [I, J dr; 0, 1],   B = diag(R(phi_k), 1),   J = [0 -1; 1 0]
//    gives Q for drivers that propagate. Others only add, P_k+1 = P_k + B Q B^T, where the first form leaves a Q that
//    is not positive: then the second is tried. Q has to be positive semidefinite, and not zero for a base that moved:
//    a constant P says nothing. P is believed once it has grown in this way in five steps of a moving base. Once a
//    variance of P shrank by neither form's leave, P is no longer believed in this stream: it is that of a
//    localisation, or one of two placeholders (standing, driving).
// 2. Else the twist covariance, if it can be meant, and once the stream has shown five different ones. Times the
//    duration of the step it is the motion's: read as white noise of that density (m^2/s, rad^2/s), since an error of
//    each sample's own would vanish as messages come faster.
// 3. Else nothing: the noise model's.
// Of a moving base, what 1 or 2 says of its position also has to be between 0.1 % and 100 % of the way, as a standard
// deviation after one metre: no wheels are better, and with worse ones nothing is said.
// The result is per second, Q / dt, so that the motion can be cut at image stamps.
#include <optional>
#include <vector>

#include "planar_vslam/sensor/measurements.h"

namespace planar_vslam {

// Of x, y and yaw; zero where the message has none.
struct OdometryMessageCovariance {
  Eigen::Matrix3d pose = Eigen::Matrix3d::Zero();   // axes of the odometry frame
  Eigen::Matrix3d twist = Eigen::Matrix3d::Zero();  // axes of the base
};

// Whether every number of `covariance` can be meant (see above).
bool IsRealCovariance(const Eigen::Matrix3d& covariance);

// Follows one stream of messages.
class MessageCovarianceReader {
 public:
  // Covariance rate of the motion from the message before to this one, [x, y, angle] along the axes of the base.
  std::optional<Eigen::Matrix3d> Rate(Timestamp stamp, const Rigid2& T_odom_base,
                                      const OdometryMessageCovariance& covariance);
  // Whether the last message had covariances that could be meant, of a stream that has not earned belief by now.
  bool placeholder() const { return placeholder_; }

 private:
  struct Last {
    Timestamp stamp;
    Rigid2 T_odom_base;
    Eigen::Matrix3d pose;
  };
  std::optional<Eigen::Matrix3d> Believed(const Rigid2& T_odom_base, const OdometryMessageCovariance& covariance,
                                          double seconds);
  std::optional<Eigen::Matrix3d> Step(const Rigid2& T_odom_base, const Eigen::Matrix3d& pose, bool moved);
  void Remember(const Eigen::Matrix3d& twist);

  std::optional<Last> last_;
  int steps_moved_ = 0, steps_grown_ = 0;
  std::vector<Eigen::Matrix3d> twists_;  // different ones, a few
  bool pose_shrank_ = false;
  bool placeholder_ = false;
};

}  // namespace planar_vslam
