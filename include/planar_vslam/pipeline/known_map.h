#pragma once
// The map that was loaded, for a drive that maps on its own because its camera saw nothing of it at the start: the
// drive's images and sweeps go on being looked for in it.
#include <memory>
#include <optional>

#include "planar_vslam/pipeline/localization.h"

namespace planar_vslam {

class KnownMap {
 public:
  // m driven, during which the camera has seen nothing of it, after which a drive begins a map of its own: some
  // twenty images, while a place that is known is found by the first few. Chosen, not fitted.
  static constexpr double kPatience = 0.5;

  // `localization` goes on from what it has gathered.
  explicit KnownMap(std::unique_ptr<Localization> localization) : localization_(std::move(localization)) {}

  const std::shared_ptr<const Map>& map() const { return localization_->map(); }
  // Where the packet's frame is in the known map, as camera or laser tell; nothing where neither does. `features`: of
  // its image. The time it took is added to `times`.
  std::optional<Rigid3> Locate(const FramePacket& packet, FrameFeaturesPtr features, StageTimes* times);

 private:
  std::unique_ptr<Localization> localization_;
};

}  // namespace planar_vslam
