#include "planar_vslam/planar/message_covariance.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

namespace planar_vslam {
namespace {

constexpr double kExact = 1e-9;               // m^2, rad^2: variances up to this are placeholders
constexpr double kNotMeasured = 1e4;          // m^2, rad^2: from this on as well
constexpr double kStandsStill = 1e-4;         // m and rad
constexpr double kRounding = 1e-9;            // of a difference, relative to what is subtracted
constexpr int kProof = 5;                     // of the header's rules 1 and 2; more than drivers have placeholders
constexpr int kPatience = 20;                 // steps of a moving base after which belief should have been earned
constexpr double kBest = 1e-3, kWorst = 1.0;  // standard deviation of the position after 1 m, in m

// Nothing where the matrix has a negative direction beyond rounding; that much is cut to zero.
std::optional<Eigen::Matrix3d> PositivePart(const Eigen::Matrix3d& difference, double rounding) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(difference);
  if (!(solver.eigenvalues().minCoeff() >= -rounding)) return std::nullopt;
  const Eigen::Matrix3d& V = solver.eigenvectors();
  return V * solver.eigenvalues().cwiseMax(0.0).asDiagonal() * V.transpose();
}

}  // namespace

bool IsRealCovariance(const Eigen::Matrix3d& covariance) {
  if (!covariance.allFinite()) return false;
  const Eigen::Vector3d variances = covariance.diagonal();
  if (!(variances.minCoeff() > kExact && variances.maxCoeff() < kNotMeasured)) return false;
  if ((covariance - covariance.transpose()).cwiseAbs().maxCoeff() > kRounding * variances.maxCoeff()) return false;
  return Eigen::LLT<Eigen::Matrix3d>(covariance).info() == Eigen::Success;
}

std::optional<Eigen::Matrix3d> MessageCovarianceReader::Rate(Timestamp stamp, const Rigid2& T_odom_base,
                                                             const OdometryMessageCovariance& covariance) {
  std::optional<Eigen::Matrix3d> rate;
  const double seconds = last_.has_value() ? SecondsBetween(last_->stamp, stamp) : 0.0;
  if (seconds > 0.0) rate = Believed(T_odom_base, covariance, seconds);
  last_ = Last{stamp, T_odom_base, covariance.pose};
  return rate;
}

std::optional<Eigen::Matrix3d> MessageCovarianceReader::Believed(const Rigid2& T_odom_base,
                                                                 const OdometryMessageCovariance& covariance,
                                                                 double seconds) {
  const double way = (T_odom_base.translation - last_->T_odom_base.translation).norm();
  const bool moved =
      way > kStandsStill || std::abs(WrapAngle(T_odom_base.angle - last_->T_odom_base.angle)) > kStandsStill;
  steps_moved_ += moved ? 1 : 0;
  const bool has_twist = IsRealCovariance(covariance.twist);
  if (has_twist) Remember(covariance.twist);
  const std::optional<Eigen::Matrix3d> Q = Step(T_odom_base, covariance.pose, moved);
  const bool twist_varies = static_cast<int>(twists_.size()) >= kProof;
  placeholder_ = (has_twist || IsRealCovariance(covariance.pose)) && steps_moved_ > kPatience &&
                 steps_grown_ < kProof && !twist_varies;
  std::optional<Eigen::Matrix3d> rate;
  if (Q.has_value() && steps_grown_ >= kProof) {
    rate = *Q / seconds;
  } else if (has_twist && twist_varies) {
    rate = covariance.twist;
  }
  if (!rate.has_value() || way <= kStandsStill) return rate;
  const double variance = rate->topLeftCorner<2, 2>().trace() * seconds / way;  // after 1 m
  if (variance < kBest * kBest || variance > kWorst * kWorst) return std::nullopt;
  return rate;
}

void MessageCovarianceReader::Remember(const Eigen::Matrix3d& twist) {
  if (static_cast<int>(twists_.size()) >= kProof) return;
  for (const Eigen::Matrix3d& known : twists_) {
    if (known == twist) return;
  }
  twists_.push_back(twist);
}

// Q of the header's first rule.
std::optional<Eigen::Matrix3d> MessageCovarianceReader::Step(const Rigid2& T_odom_base, const Eigen::Matrix3d& pose,
                                                             bool moved) {
  if (pose_shrank_ || !IsRealCovariance(last_->pose) || !IsRealCovariance(pose)) return std::nullopt;
  const double rounding = kRounding * pose.diagonal().maxCoeff();
  const Eigen::Vector2d dr = T_odom_base.translation - last_->T_odom_base.translation;
  Eigen::Matrix3d A = Eigen::Matrix3d::Identity();
  A(0, 2) = -dr.y();
  A(1, 2) = dr.x();
  std::optional<Eigen::Matrix3d> gained = PositivePart(pose - A * last_->pose * A.transpose(), rounding);
  if (!gained.has_value()) {
    const Eigen::Matrix3d difference = pose - last_->pose;
    pose_shrank_ = (difference.diagonal().array() < -rounding).any();
    gained = PositivePart(difference, rounding);
  }
  if (!gained.has_value()) return std::nullopt;
  const bool grown = gained->trace() > rounding;
  if (moved && !grown) return std::nullopt;
  steps_grown_ += moved ? 1 : 0;
  Eigen::Matrix3d B = Eigen::Matrix3d::Identity();
  B.topLeftCorner<2, 2>() = last_->T_odom_base.R();
  return B.transpose() * *gained * B;
}

}  // namespace planar_vslam
