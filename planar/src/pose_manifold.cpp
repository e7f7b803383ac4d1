#include "planar_vslam/planar/pose_manifold.h"

namespace planar_vslam {

void StorePose(const Rigid3& T, double* block) {
  Eigen::Map<Eigen::Vector3d>{block} = T.translation;
  Eigen::Map<Eigen::Vector4d>{block + 3} = T.rotation.coeffs();  // x y z w
}

Rigid3 LoadPose(const double* block) {
  return {Eigen::Quaterniond(Eigen::Map<const Eigen::Quaterniond>(block + 3)),
          Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(block))};
}

// Near y = x the rotation part of Minus is twice the vector part of q_x^* q_y = w_x v_y - w_y v_x - v_x x v_y.
PoseJacobianMap PoseMinusJacobian(const double* block) {
  const Rigid3 T = LoadPose(block);
  const Eigen::Vector3d v = T.rotation.vec();
  PoseJacobianMap J = PoseJacobianMap::Zero();
  J.topLeftCorner<3, 3>() = T.R().transpose();
  J.block<3, 3>(3, 3) = 2.0 * (T.rotation.w() * Eigen::Matrix3d::Identity() - Skew(v));
  J.block<3, 1>(3, 6) = -2.0 * v;
  return J;
}

bool PoseManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const Rigid3 T = LoadPose(x);
  const Eigen::Map<const Vector6d> d(delta);
  StorePose(
      {(T.rotation * ExpSo3(d.tail<3>())).normalized(), Eigen::Vector3d(T.translation + T.rotation * d.head<3>())},
      x_plus_delta);
  return true;
}

// q Exp(d) = q + q [d / 2, 0] to first order.
bool PoseManifold::PlusJacobian(const double* x, double* jacobian) const {
  const Rigid3 T = LoadPose(x);
  const Eigen::Vector3d v = T.rotation.vec();
  Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>> J(jacobian);
  J.setZero();
  J.topLeftCorner<3, 3>() = T.R();
  J.block<3, 3>(3, 3) = 0.5 * (T.rotation.w() * Eigen::Matrix3d::Identity() + Skew(v));
  J.block<1, 3>(6, 3) = -0.5 * v.transpose();
  return true;
}

bool PoseManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  const Rigid3 T_y = LoadPose(y);
  const Rigid3 T_x = LoadPose(x);
  const Eigen::Quaterniond inverse = T_x.rotation.conjugate();
  Eigen::Map<Vector6d> d(y_minus_x);
  d.head<3>() = inverse * (T_y.translation - T_x.translation);
  d.tail<3>() = LogSo3(inverse * T_y.rotation);
  return true;
}

bool PoseManifold::MinusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<PoseJacobianMap> J(jacobian);
  J = PoseMinusJacobian(x);
  return true;
}

bool PartialPoseManifold::PlusJacobian(const double* x, double* jacobian) const {
  Eigen::Matrix<double, 7, 6, Eigen::RowMajor> plus;
  PoseManifold().PlusJacobian(x, plus.data());
  Eigen::Map<Eigen::Matrix<double, 7, 3, Eigen::RowMajor>> J(jacobian);
  J.noalias() = plus * Tangent(LoadPose(x));
  return true;
}

bool PartialPoseManifold::MinusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 3, 7, Eigen::RowMajor>> J(jacobian);
  J.noalias() = Tangent(LoadPose(x)).transpose() * PoseMinusJacobian(x);
  return true;
}

Eigen::Matrix<double, 6, 3> FloorTangent(const Rigid3& T) {
  const Eigen::Matrix3d R_base_map = T.R().transpose();
  Eigen::Matrix<double, 6, 3> E = Eigen::Matrix<double, 6, 3>::Zero();
  E.topLeftCorner<3, 2>() = R_base_map.leftCols<2>();
  E.bottomRightCorner<3, 1>() = R_base_map.col(2);
  return E;
}

bool FloorPoseManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const Rigid3 T = LoadPose(x);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(delta[2], Eigen::Vector3d::UnitZ()));
  StorePose(
      {(turn * T.rotation).normalized(), Eigen::Vector3d(T.translation + Eigen::Vector3d(delta[0], delta[1], 0.0))},
      x_plus_delta);
  return true;
}

bool FloorPoseManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  const Rigid3 T_y = LoadPose(y);
  const Rigid3 T_x = LoadPose(x);
  y_minus_x[0] = T_y.translation.x() - T_x.translation.x();
  y_minus_x[1] = T_y.translation.y() - T_x.translation.y();
  y_minus_x[2] = LogSo3(T_y.rotation * T_x.rotation.conjugate()).z();
  return true;
}

Eigen::Matrix<double, 6, 3> LevelTangent(const Rigid3& T) {
  const Eigen::Matrix3d R_base_map = T.R().transpose();
  Eigen::Matrix<double, 6, 3> E = Eigen::Matrix<double, 6, 3>::Zero();
  E.topLeftCorner<3, 1>() = R_base_map.col(2);
  E.bottomRightCorner<3, 2>() = R_base_map.leftCols<2>();
  return E;
}

bool LevelPoseManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const Rigid3 T = LoadPose(x);
  const Eigen::Quaterniond tilt = ExpSo3(Eigen::Vector3d(delta[1], delta[2], 0.0));
  StorePose({(tilt * T.rotation).normalized(), Eigen::Vector3d(T.translation + Eigen::Vector3d(0.0, 0.0, delta[0]))},
            x_plus_delta);
  return true;
}

bool LevelPoseManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  const Rigid3 T_y = LoadPose(y);
  const Rigid3 T_x = LoadPose(x);
  const Eigen::Vector3d turn = LogSo3(T_y.rotation * T_x.rotation.conjugate());
  y_minus_x[0] = T_y.translation.z() - T_x.translation.z();
  y_minus_x[1] = turn.x();
  y_minus_x[2] = turn.y();
  return true;
}

}  // namespace planar_vslam
