#include "planar_vslam/pipeline/pose_slew.h"

#include <algorithm>
#include <cmath>

#include "planar_vslam/geometry/tangent_parts.h"

namespace planar_vslam {

PoseSlew::Published PoseSlew::Publish(const Pose& estimate, const std::optional<Rigid2>& step, Timestamp stamp) {
  // Nine tenths of what a controller may see: it interpolates odometry in its own way.
  constexpr double kSpeed = 0.9 * 0.02 / 0.05;                  // m/s
  constexpr double kTurn = 0.9 * DegreesToRadians(1.0) / 0.05;  // rad/s
  constexpr double kLongest = 0.5;                              // s
  Published published{estimate, false};
  const Rigid2 target = ProjectToPlane(estimate.T_map_base);
  if (last_.has_value() && step.has_value()) {
    const Rigid2 led = last_->T_map_base * *step;
    const Rigid2 correction = led.Inverse() * target;
    const double distance = correction.translation.norm(), angle = std::abs(correction.angle);
    published.jumped = distance > kLongest * kSpeed || angle > kLongest * kTurn;
    const double seconds = SecondsBetween(last_->stamp, stamp);
    const double share =
        std::min({1.0, seconds * kSpeed / std::max(distance, 1e-9), seconds * kTurn / std::max(angle, 1e-9)});
    if (!published.jumped && share < 1.0) {
      const Rigid2 paid(share * correction.translation, share * correction.angle);
      const Rigid2 now = led * paid;
      published.T_map_base = Embed3(now * target.Inverse()) * estimate.T_map_base;
      const Eigen::Vector3d owed = LogSe2(now.Inverse() * target);
      published.covariance(kPlanarRows, kPlanarRows) += owed * owed.transpose();
    }
  }
  last_ = Last{ProjectToPlane(published.T_map_base), stamp};
  return published;
}

}  // namespace planar_vslam
