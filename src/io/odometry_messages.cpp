#include "planar_vslam/io/odometry_messages.h"

#include <fmt/format.h>
#include <nav_msgs/Odometry.h>

#include <algorithm>
#include <cmath>

#include "bag_messages.h"

namespace planar_vslam::io {
namespace {

constexpr double kLongestStep = 1.0;  // s: a twist says nothing of a longer time

}  // namespace

Expected<OdometryReading> OdometryMessages::Read(const nav_msgs::Odometry& odometry, const Rigid3& T_child_base) {
  const Expected<Rigid3> T_odom_child = by_twist_ ? Drive(odometry) : ToOdometryPose(odometry);
  if (!T_odom_child) return T_odom_child.error();
  OdometryReading reading{ToTimestamp(odometry.header.stamp), ProjectToPlane(*T_odom_child * T_child_base)};
  OdometryMessageCovariance covariance = ToOdometryCovariance(odometry, T_child_base);
  if (by_twist_) covariance.pose.setZero();
  reading.covariance_rate = covariance_.Rate(reading.stamp, reading.T_odom_base, covariance);
  return reading;
}

// By the mean of the twists at both ends.
Expected<Rigid3> OdometryMessages::Drive(const nav_msgs::Odometry& odometry) {
  const std::optional<Eigen::Vector3d> twist = ToOdometryTwist(odometry);
  if (!twist.has_value()) return Error{"odometry twist not finite"};
  const Timestamp stamp = ToTimestamp(odometry.header.stamp);
  Rigid2 T_start_child;
  if (driven_.has_value()) {
    const double seconds = SecondsBetween(driven_->stamp, stamp);
    T_start_child = driven_->T_start_child * ExpSe2(0.5 * seconds * (driven_->twist + *twist));
  }
  driven_ = Driven{stamp, *twist, T_start_child};
  return Embed3(T_start_child);
}

void OdometrySurvey::Add(const nav_msgs::Odometry& odometry) {
  ++count_;
  const Expected<Rigid3> pose = ToOdometryPose(odometry);
  usable_ += pose.ok() ? 1 : 0;
  if (!pose) ++refused_[pose.error().message];
  const auto& p = odometry.pose.pose.position;
  const auto& q = odometry.pose.pose.orientation;
  const Rigid3 as_it_came(Eigen::Quaterniond(q.w, q.x, q.y, q.z), Eigen::Vector3d(p.x, p.y, p.z));
  const double length = as_it_came.rotation.norm();
  if (!IsRotation(as_it_came.rotation) && std::isfinite(length)) {
    shortest_ = std::min(shortest_.value_or(length), length);
    longest_ = std::max(longest_.value_or(length), length);
  }
  if (!first_.has_value()) first_ = as_it_came;
  changed_ = changed_ || as_it_came.translation != first_->translation ||
             as_it_came.rotation.coeffs() != first_->rotation.coeffs();
  const Timestamp stamp = ToTimestamp(odometry.header.stamp);
  const std::optional<Eigen::Vector3d> twist = ToOdometryTwist(odometry);
  const double seconds = last_stamp_.has_value() ? SecondsBetween(*last_stamp_, stamp) : 0.0;
  last_stamp_ = stamp;
  if (!twist.has_value() || seconds <= 0.0 || seconds > kLongestStep) return;
  way_ += seconds * twist->head<2>().norm();
  turn_ += seconds * std::abs(twist->z());
}

std::string OdometrySurvey::DescribeRefused() const {
  if (!shortest_.has_value()) return "most poses cannot be used";
  constexpr double kSame = 0.005;
  const std::string lengths = *longest_ - *shortest_ < kSame ? fmt::format("{:.2f}", *longest_)
                                                             : fmt::format("{:.2f} to {:.2f}", *shortest_, *longest_);
  return fmt::format(
      "the orientation of most poses has length {} instead of 1 (the publisher does not normalise it, or "
      "does not fill it in), so they are not used",
      lengths);
}

bool OdometrySurvey::pose_stands() const {
  constexpr double kDriven = 0.2;  // m or rad: wheels whose pose is kept have long changed it
  return !changed_ && (way_ > kDriven || turn_ > kDriven);
}

}  // namespace planar_vslam::io
