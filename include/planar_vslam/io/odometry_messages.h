#pragma once
// A stream of nav_msgs/Odometry as readings of the base, for bags and nodes alike.
#include <map>
#include <optional>
#include <string>

#include "planar_vslam/io/message_values.h"

namespace planar_vslam::io {

class OdometryMessages {
 public:
  // `by_twist`: poses are not looked at, the twist is integrated instead.
  explicit OdometryMessages(bool by_twist = false) : by_twist_(by_twist) {}

  // The reading of the next message, stamped later than the one before. T_child_base at its stamp. An error is the
  // reason to count it by.
  Expected<OdometryReading> Read(const nav_msgs::Odometry& odometry, const Rigid3& T_child_base);
  // Whether the message read last had covariances that are placeholders, see planar/message_covariance.h.
  bool placeholder_covariance() const { return covariance_.placeholder(); }

 private:
  struct Driven {
    Timestamp stamp;
    Eigen::Vector3d twist;
    Rigid2 T_start_child;
  };
  Expected<Rigid3> Drive(const nav_msgs::Odometry& odometry);

  bool by_twist_;
  std::optional<Driven> driven_;
  MessageCovarianceReader covariance_;
};

// What a stream is worth as a whole. Messages come in any order of stamps.
class OdometrySurvey {
 public:
  void Add(const nav_msgs::Odometry& odometry);

  // Whether the pose has stayed what it was first, although the twist has driven or turned: a driver that leaves
  // integration to others.
  bool pose_stands() const;
  // Whether most poses can be used.
  bool poses_usable() const { return 2 * usable_ > count_; }
  // Why the others cannot, and how many.
  const std::map<std::string, long>& refused() const { return refused_; }
  // In a few words, with the lengths of orientations that are none.
  std::string DescribeRefused() const;

 private:
  long count_ = 0, usable_ = 0;
  std::map<std::string, long> refused_;
  std::optional<double> shortest_, longest_;  // orientation that is none
  std::optional<Rigid3> first_;               // as it came
  bool changed_ = false;
  std::optional<Timestamp> last_stamp_;
  double way_ = 0.0, turn_ = 0.0;  // by the twist, m and rad
};

}  // namespace planar_vslam::io
