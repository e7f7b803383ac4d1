#include "planar_vslam/frontend/tracking_state.h"

namespace planar_vslam {

const char* ToString(TrackingState state) {
  switch (state) {
    case TrackingState::kInitializing:
      return "initializing";
    case TrackingState::kTracking:
      return "tracking";
    case TrackingState::kRelocalized:
      return "relocalized";
    case TrackingState::kOdometry:
      return "odometry";
    case TrackingState::kLost:
      break;
  }
  return "lost";
}

}  // namespace planar_vslam
