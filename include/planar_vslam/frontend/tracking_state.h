#pragma once
namespace planar_vslam {

enum class TrackingState {
  kInitializing,  // there is no map yet, or no place of it has been recognised
  kTracking,      // pose from vision (and odometry)
  kRelocalized,   // the same, first frame after a time without
  kOdometry,      // pose predicted by odometry
  kLost,          // no pose
};

// In lower case, as status.csv, report.json and diagnostics have it.
const char* ToString(TrackingState state);

}  // namespace planar_vslam
