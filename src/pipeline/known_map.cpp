#include "planar_vslam/pipeline/known_map.h"

namespace planar_vslam {

std::optional<Rigid3> KnownMap::Locate(const FramePacket& packet) {
  FrameReport report;
  (void)localization_->Locate(packet, KeyframeSlot::kNone, &report, nullptr);
  const bool confirmed = report.state == TrackingState::kTracking || report.state == TrackingState::kRelocalized;
  return confirmed ? report.T_map_base : std::nullopt;
}

}  // namespace planar_vslam
