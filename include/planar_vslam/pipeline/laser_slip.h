#pragma once
// Wheels that slip while the camera sees nothing: sweeps tell. Between two frames the base moved by x = [x, y, angle]
// (in the frame of the first) as the wheels say, and by z as matching the last sweeps before both says. They contradict
// each other where
//   d^T (C_wheels + C_match)^-1 d > 16.3 (99.9 % of chi-square with 3 degrees),   d = z - x;
// then the wheels count by as little as they missed, C = C_wheels + d d^T, and the step is what both say:
//   K = C (C + C_match)^-1,   x <- x + K d,   C <- (I - K) C.
// Along a bare corridor the wheels go on to tell.
#include <optional>

#include "planar_vslam/pipeline/synchronizer.h"
#include "planar_vslam/planar/preintegration.h"
#include "planar_vslam/planar/scan_matching.h"

namespace planar_vslam {

class LaserSlip {
 public:
  explicit LaserSlip(const ScanMatchOptions& options) : options_(options) {}

  // Takes each frame. The step since the frame before where the wheels slipped; nothing where they did not, or the
  // camera sees for itself (`blind` is false), or sweeps do not tell, as where frames were left out.
  std::optional<PlanarMotion> Check(const FramePacket& packet, const PlanarMotion& step, bool blind);

 private:
  ScanMatchOptions options_;
  ScanPacket last_;                 // before the image of...
  std::optional<Timestamp> frame_;  // ...this frame; none where it had no sweep
};

}  // namespace planar_vslam
