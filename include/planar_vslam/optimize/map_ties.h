#pragma once
// What holds the keyframes of a metric map where they are: ties, each a relative pose [x, y, heading] of two keyframes
// with a covariance. What the map has drifted, and how it gives way where a loop closes, is told by them.
//   - Odometry and laser links, with their own covariance: each with the floors of who measured.
//   - Landmarks in common. n of them, of N that j sees, at a depth z tell a heading to
//       sigma = k sigma_px / (f sqrt(n)) * N / n
//     and a position to z sigma, along the way between the two to a share of its length besides, which one camera does
//     not measure. The factor k makes up for what neighbours' ties share: they are no independent measurements, as they
//     come from the same landmarks. N / n: a pose goes with the majority of what it sees. With
//     keyframes a long way back only one that has returned there (distance_driven.h) is tied: a few landmarks of an old
//     place do not bring a pose home.
// A step of the wheels across which a rich view became quite another one is doubtful: something stood before the
// camera, or the robot was kidnapped. Until landmarks tie the two sides together it counts for next to nothing.
#include <Eigen/Core>
#include <vector>

#include "planar_vslam/map/distance_driven.h"
#include "planar_vslam/map/map.h"
#include "planar_vslam/optimize/bundle_adjustment.h"

namespace planar_vslam {

enum class TieSource { kWheels, kLaser, kLandmarks };

struct MapTie {
  KeyframeId from, to;         // the latter is the newer
  Eigen::Matrix3d covariance;  // of the right tangent [x, y, angle] at `to`
  TieSource source;
  bool doubtful = false;
};

// Of a metric map, in the order of their newer keyframes.
std::vector<MapTie> TiesOf(const Map& map, const MeasurementModel& context);

// The same, kept from one state of a map to the next: only ties of what has changed between them are made anew.
class MapTies {
 public:
  // What has changed since the state before, ascending.
  struct Changes {
    std::vector<KeyframeId> moved, erased;
    std::vector<KeyframeId> retied;  // those whose ties to older ones are not what they were, and new ones
  };

  explicit MapTies(const MeasurementModel& context) : context_(context) {}

  Changes Follow(const Map& map);

  // TiesOf() the map.
  std::vector<MapTie> All() const;
  // Those of one keyframe with older ones.
  const std::vector<MapTie>& Of(KeyframeId id) const { return ties_.At(id); }
  const DistanceDriven& driven() const { return driven_; }

 private:
  std::vector<KeyframeId> ToTieAnew(const Map& map, Changes* changes);

  MeasurementModel context_;
  Map map_;  // as it was
  DistanceDriven driven_;
  IdMap<KeyframeId, std::vector<MapTie>> ties_;
  // By id: m that distances driven may change by before another of them counts as a return, or one no longer.
  std::vector<double> slack_;
};

}  // namespace planar_vslam
