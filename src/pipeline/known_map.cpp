#include "planar_vslam/pipeline/known_map.h"

#include <utility>

namespace planar_vslam {

std::optional<Rigid3> KnownMap::Locate(const FramePacket& packet, FrameFeaturesPtr features, StageTimes* times) {
  const Stopwatch locating;
  FrameReport report;
  report.stamp = packet.image.stamp;
  const TrackedFrame frame = localization_->Locate(packet, KeyframeSlot::kNone, &report, nullptr, std::move(features));
  times->push_back({"frame.known_map", locating.Milliseconds()});
  const bool confirmed = report.state == TrackingState::kTracking || report.state == TrackingState::kRelocalized;
  // Not the pose as it is published, which follows in small steps.
  return confirmed ? std::optional(frame.track.T_map_base) : std::nullopt;
}

}  // namespace planar_vslam
