#pragma once

namespace planar_vslam {

// What the pose of a frame rests on.
enum class TrackingState {
  kInitializing,  // no map, or no place in it yet
  kTracking,      // vision, and odometry
  kRelocalized,   // the same, first frame after a time without
  kOdometry,      // odometry alone
  kLost,          // nothing: there is no pose
};
const char* ToString(TrackingState state);  // in lower case, without the k

}  // namespace planar_vslam
