#pragma once
// A saved map as something to be localised in, by laser and camera: where the robot is while nobody knows it
// (PlaceFinder), and what the laser says of its pose once it is known (LaserTracker).
#include <memory>
#include <optional>
#include <vector>

#include "planar_vslam/frontend/tracker.h"
#include "planar_vslam/localize/place_belief.h"
#include "planar_vslam/localize/surface_map.h"
#include "planar_vslam/map/map.h"
#include "planar_vslam/pipeline/sight_search.h"
#include "planar_vslam/pipeline/synchronizer.h"
#include "planar_vslam/recognition/place.h"

namespace planar_vslam {

// The sweeps of a map, ready to be compared with. Both null where the map has none, or no scale.
struct MapLaser {
  std::shared_ptr<const LikelihoodField> field;
  std::shared_ptr<const SurfaceMap> surfaces;
};
MapLaser LaserOf(const Map& map, const ScanMatchOptions& options);

class PlaceFinder {
 public:
  // `localized`: odometry says about where the robot is. `map`: for views beside the laser, which are weighed at once,
  // as soon as it is ready; `sight` has the same.
  PlaceFinder(std::shared_ptr<const LikelihoodField> field, bool localized, SightMapFuture map, SightSearch sight)
      : waits_for_sweeps_(field != nullptr),
        belief_(std::move(field), localized),
        map_(std::move(map)),
        sight_(std::move(sight)) {}

  // The robot moved to where this packet was taken; its sweeps. `step`: the identity where the robot just began.
  void Add(const FramePacket& packet, const Rigid2& step);
  // The packet's image, where a search by descriptors would put it, and where the robot is by odometry; nothing where
  // it may be anywhere.
  void AddView(const CameraView& view, const std::vector<Placement>& seen, const std::optional<SettledPlace>& expected);
  // Where the robot is now, once that is clear. What images tell is told once a view.
  std::optional<SettledPlace> Found();
  bool Contradicts(const Rigid3& T_map_base) const { return belief_.Contradicts(ProjectToPlane(T_map_base)); }
  // Whether the laser sees enough to tell. Where it does not, images of several places have to agree on one.
  bool ByLaser() const { return belief_.SeesEnough(); }

 private:
  void AddViewBesideLaser(const CameraView& view, const std::vector<Placement>& seen);
  // Log odds that the view was taken there.
  double LookFrom(const Rigid2& place, const CameraView& view);

  bool waits_for_sweeps_;  // for some packets, before images have to do
  int packets_ = 0;
  PlaceBelief belief_;
  SightMapFuture map_;
  SightSearch sight_;
};

class LaserTracker {
 public:
  explicit LaserTracker(const MapLaser& laser) : laser_(laser) {}

  // The pose at the packet's image by its latest sweep, near `guess`, of which `covariance` is that of a right
  // perturbation [x, y, angle].
  std::optional<PlanarFix> Fix(const FramePacket& packet, const Rigid2& guess, const Eigen::Matrix3d& covariance) const;

 private:
  std::optional<LaserFix> BestAround(const ScanPacket& scan, const std::vector<Eigen::Vector2d>& points,
                                     const Rigid2& guess) const;

  MapLaser laser_;
};

}  // namespace planar_vslam
