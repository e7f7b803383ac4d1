#include "robot_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "planar_vslam/geometry/angles.h"

namespace planar_vslam::ros_face {
namespace {

// What navigation usually tolerates at a goal (xy_goal_tolerance, yaw_goal_tolerance).
constexpr double kGoalDistance = 0.1;  // m
constexpr double kGoalAngle = 0.1;     // rad

}  // namespace

double Quality(const FrameReport& frame) {
  if (!frame.T_map_base.has_value() || frame.state == TrackingState::kLost) return 0.0;
  const double position = std::max(frame.covariance(0, 0), frame.covariance(1, 1)) / (kGoalDistance * kGoalDistance);
  const double heading = frame.covariance(5, 5) / (kGoalAngle * kGoalAngle);
  const double worse = std::max(position, heading);
  return std::isfinite(worse) && worse >= 0.0 ? 1.0 / (1.0 + worse) : 0.0;
}

std::string LocalisedBy(const FrameReport& frame, int min_inliers) {
  switch (frame.state) {
    case TrackingState::kTracking:
    case TrackingState::kRelocalized:
      return frame.inliers >= min_inliers ? "camera" : "laser";
    case TrackingState::kOdometry:
      return "odometry";
    case TrackingState::kInitializing:
    case TrackingState::kLost:
      break;
  }
  return "nothing";
}

void EventFinder::FindJump(const FrameReport& frame, std::vector<RobotEvent>* events) {
  if (!frame.T_map_odom.has_value()) return;
  if (T_map_odom_.has_value() && frame.T_map_base.has_value()) {
    // Where the robot was before and is now, by the same odometry: far from odom's origin a turn alone would move that.
    const Rigid2 T_map_base = ProjectToPlane(*frame.T_map_base);
    const Rigid2 before = *T_map_odom_ * frame.T_map_odom->Inverse() * T_map_base;
    const Rigid2 step = before.Inverse() * T_map_base;
    const double distance = step.translation.norm();
    if (distance > kGoalDistance || std::abs(step.angle) > kGoalAngle) {
      events->push_back({"jump", fmt::format("the pose moved by {:.2f} m, {:.1f} deg against odometry", distance,
                                             RadiansToDegrees(step.angle))});
    }
  }
  T_map_odom_ = frame.T_map_odom;
}

std::vector<RobotEvent> EventFinder::OnFrame(const FrameReport& frame, std::size_t loops) {
  std::vector<RobotEvent> events;
  FindJump(frame, &events);
  if (frame.odometry_rejected && !slipping_) events.push_back({"slip", "the wheels went another way than the view"});
  slipping_ = frame.odometry_rejected;
  if (loops > loops_) events.push_back({"loop", fmt::format("{} closed in this map", loops)});
  loops_ = loops;
  if (frame.joined) events.push_back({"map joined", "the drive's own map with the one that was loaded"});
  if (frame.state == TrackingState::kRelocalized) {
    events.push_back({"relocalised", fmt::format("by {} landmarks", frame.inliers)});
  }
  const bool lost = frame.state == TrackingState::kLost;
  if (lost && !lost_) events.push_back({"lost", "neither camera, laser nor odometry tell the pose"});
  lost_ = lost;
  return events;
}

}  // namespace planar_vslam::ros_face
