#pragma once
// How far a metric map may have drifted, kept from one state of it to the next: its ties (map_ties.h), and how
// uncertain the pose of its newest keyframe is (map_uncertainty.h). In a large map the keyframes among which nothing
// has changed are settled: H is eliminated down to those at their border once,
//   H_b' = H_bb - H_bp H_pp^-1 H_pb,  p settled, b border and the systematic errors,
// and a new keyframe costs what the rest does. Where something settled changes, as where a loop is closed or the robot
// comes to another part of the map, others are settled anew.
#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "planar_vslam/optimize/map_ties.h"
#include "planar_vslam/optimize/map_uncertainty.h"

namespace planar_vslam {

class MapDrift {
 public:
  MapDrift(const MeasurementModel& context, const SystematicErrors& systematic);
  ~MapDrift();
  MapDrift(const MapDrift&) = delete;
  MapDrift& operator=(const MapDrift&) = delete;

  // Goes on to a later state of the map, which is metric and has a keyframe.
  void Follow(const Map& map);

  const MapTies& ties() const { return ties_; }
  // That of MapUncertainty, to rounding; to the bit in a map of no more than `kWhole` keyframes.
  Eigen::Matrix3d CovarianceOfNewest() const;
  // Of all keyframes. O(keyframes).
  MapUncertainty Uncertainty() const;

  static constexpr std::size_t kWhole = 300;

 private:
  class Settled;

  SystematicErrors systematic_;
  MapTies ties_;
  Map map_;
  std::unique_ptr<Settled> settled_;                   // none in a small map
  mutable std::optional<Eigen::Matrix3d> covariance_;  // of the newest, once it has been asked for
};

}  // namespace planar_vslam
