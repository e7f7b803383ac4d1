#include "planar_vslam/frontend/motion_agreement.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>

#include "planar_vslam/planar/preintegration.h"

namespace planar_vslam {
namespace {

// A mount nobody has calibrated yet: degrees and centimetres as ROS descriptions of robots have them wrong.
constexpr double kMountSigmaAngle = DegreesToRadians(3.0);  // rad
constexpr double kMountSigmaPosition = 0.02;                // m

Eigen::Matrix<double, 2, 3> WeightedProjectionJacobian(const CameraModel& c, const Eigen::Vector3d& p, double sigma) {
  const double iz = 1.0 / p.z();
  Eigen::Matrix<double, 2, 3> J;
  J << c.fx * iz, 0.0, -c.fx * p.x() * iz * iz, 0.0, c.fy * iz, -c.fy * p.y() * iz * iz;
  return J / sigma;
}

double Sigma(const Map& map, const MeasurementModel& context, const Keyframe& keyframe, const Observation& o) {
  const Keypoint& keypoint = keyframe.features->keypoints[o.keypoint];
  return context.pixel_sigma * map.octave_scales[static_cast<std::size_t>(keypoint.octave)];
}

// Information on the second camera's pose in the first (right tangent), the points marginalised.
Matrix6d ViewInformation(const Map& map, const MeasurementModel& context) {
  const Keyframe& first = map.keyframes.begin()->second;
  const Keyframe& second = std::prev(map.keyframes.end())->second;
  const Rigid3 T_c1_map = first.T_map_camera().Inverse(), T_c2_map = second.T_map_camera().Inverse();
  const Eigen::Matrix3d R_c2_c1 = (T_c2_map * T_c1_map.Inverse()).R();
  Matrix6d H = Matrix6d::Zero();
  for (const auto& [id, landmark] : map.landmarks) {
    if (landmark.observations.size() < 2) continue;
    const Eigen::Vector3d p1 = T_c1_map * landmark.p_map, p2 = T_c2_map * landmark.p_map;
    if (std::min(p1.z(), p2.z()) <= 0.0) continue;
    const Eigen::Matrix<double, 2, 3> J1 =
        WeightedProjectionJacobian(context.camera, p1, Sigma(map, context, first, landmark.observations.front()));
    const Eigen::Matrix<double, 2, 3> J2 =
        WeightedProjectionJacobian(context.camera, p2, Sigma(map, context, second, landmark.observations.back()));
    Eigen::Matrix<double, 2, 6> J_pose;
    J_pose << -J2, J2 * Skew(p2);
    const Eigen::Matrix<double, 2, 3> J_point = J2 * R_c2_c1;
    const Eigen::Matrix3d A = J1.transpose() * J1 + J_point.transpose() * J_point;
    const Eigen::Matrix<double, 6, 3> B = J_pose.transpose() * J_point;
    H += J_pose.transpose() * J_pose - B * A.ldlt().solve(B.transpose());
  }
  return H;
}

// Its inverse with the length of the translation held.
Matrix6d ViewCovariance(const Matrix6d& information, const Vector6d& along_scale) {
  const Eigen::HouseholderQR<Vector6d> qr(along_scale);
  const Matrix6d Q = qr.householderQ();
  const Eigen::Matrix<double, 6, 5> N = Q.rightCols<5>();
  const Eigen::Matrix<double, 5, 5> known = N.transpose() * information * N;
  return N * known.ldlt().solve(Eigen::Matrix<double, 5, 5>::Identity()) * N.transpose();
}

Matrix6d MountCovariance(const Rigid3& T_b1_b2) {
  const Matrix6d J = AdjointSe3(T_b1_b2.Inverse()) - Matrix6d::Identity();
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(kMountSigmaPosition * kMountSigmaPosition),
      Eigen::Vector3d::Constant(kMountSigmaAngle * kMountSigmaAngle);
  return J * variances.asDiagonal() * J.transpose();
}

}  // namespace

double SquaredMotionDisagreement(const Map& two_views, const MeasurementModel& context) {
  const Keyframe& first = two_views.keyframes.begin()->second;
  const Keyframe& second = std::prev(two_views.keyframes.end())->second;
  const PlanarMotion& odometry = second.odometry_link->motion;
  const Rigid3 T_b1_b2 = Embed3(odometry.T_i_j);
  const Rigid3 T_c1_c2 = first.T_map_camera().Inverse() * second.T_map_camera();
  Vector6d along_scale = Vector6d::Zero();
  along_scale.head<3>() = T_c1_c2.R().transpose() * T_c1_c2.translation;
  const Matrix6d views = ViewCovariance(ViewInformation(two_views, context), along_scale);
  const Matrix6d others = LiftedCovariance(odometry, context.odometry_noise) + MountCovariance(T_b1_b2);
  const Matrix6d adjoint = AdjointSe3(second.T_base_camera);

  const Rigid3 T_c1_c2_odometry = first.T_base_camera.Inverse() * T_b1_b2 * second.T_base_camera;
  double scale = T_c1_c2_odometry.translation.norm() / T_c1_c2.translation.norm();
  double squared = 0.0;
  constexpr int kIterations = 4;  // e is linear in s but for the small rotation in it
  for (int i = 0; i < kIterations; ++i) {
    Vector6d units = Vector6d::Ones();
    units.head<3>() *= scale;
    const Matrix6d to_base = adjoint * units.asDiagonal();
    const Matrix6d S = SquareRootInformation(others + to_base * views * to_base.transpose());
    const Rigid3 T_scaled(T_c1_c2.rotation, scale * T_c1_c2.translation);
    const Vector6d log = LogSe3(T_b1_b2.Inverse() * first.T_base_camera * T_scaled * second.T_base_camera.Inverse());
    const Vector6d e = S * log, slope = S * RightJacobianInverseSe3(log) * adjoint * along_scale;
    squared = e.squaredNorm();
    scale = std::max(0.0, scale - slope.dot(e) / slope.squaredNorm());
  }
  return squared;
}

}  // namespace planar_vslam
