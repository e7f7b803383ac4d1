#pragma once
// Whether a robot in a known map still knows its place, and the search for it while it does not: counts who confirmed
// the poses, keeps what the map's sweeps tell, and gathers evidence from packets while nobody does.
#include <memory>
#include <optional>

#include "planar_vslam/pipeline/blind_drift.h"
#include "planar_vslam/pipeline/executor.h"
#include "planar_vslam/pipeline/options.h"
#include "planar_vslam/pipeline/saved_place.h"

namespace planar_vslam {

struct RelocalizerOptions {
  LaserLocalize laser = LaserLocalize::kAuto;
  ScanMatchOptions scan_match;
  SystematicErrors systematic;
  bool has_floor = true;  // the robot stays on it: images of several places can be joined
  Schedule schedule = Schedule::kInline;
};

// Where odometry leads from a pose.
PlanarFix Moved(const PlanarFix& from, const PlanarMotion& step);

// What is known of a packet's place before anything is searched for.
struct PlaceQuery {
  const FramePacket& packet;
  const std::shared_ptr<const Map>& map;
  std::optional<PlanarMotion> step;  // by odometry, since the packet before...
  std::optional<PlanarFix> last;     // ...and where that was; nothing while frames have no pose
  bool map_grows = false;
};

class Relocalizer {
 public:
  explicit Relocalizer(const RelocalizerOptions& options);

  // The map stays as it is from now on: its sweeps tell poses.
  void UseSweeps(const Map& map);
  // Somebody says where the robot is.
  void OnGivenPose();

  // Where the place is unknown, or long unconfirmed: adds what the packet says of it. The place, once it is clear.
  std::optional<PlanarFix> Find(const PlaceQuery& query);
  // Whether a view alone may say that the robot is somewhere else, or where it is at first.
  bool ViewMayJump() const;
  // What the laser says of the pose that is `predicted`, in a map that stays as it is.
  std::optional<PlanarFix> FixByLaser(const FramePacket& packet, const PlanarFix& predicted) const;
  // While the place is searched for: a view that was not found, where a search by descriptors would put it, and where
  // odometry leads; nothing while frames have no pose.
  void AddView(const CameraView& view, const std::vector<Placement>& seen, const std::optional<PlanarFix>& predicted);
  // ...and whether the laser sees another place than this one, which a view gave.
  bool Contradicts(const Rigid3& T_map_base) const;

  // Who told the pose of this frame: the camera, the laser all of it, or nobody.
  void Note(Timestamp stamp, bool by_camera, bool by_laser);
  // Whether the laser has told the whole pose a moment ago.
  bool IsFixed(Timestamp stamp) const;
  // What wheels that read wrong throughout add to the covariance of poses on odometry, in a map that stays as it is.
  Eigen::Matrix3d Drift() const { return drift_.Covariance(); }

 private:
  PlanarFix WithDrift(PlanarFix fix) const;

  RelocalizerOptions options_;
  // The map that was searched last, and what a search by images needs of it.
  struct Searched {
    std::shared_ptr<const Map> map;
    SightMapFuture sights;
  };

  MapLaser map_laser_;  // of the map that was started in
  Searched searched_;
  std::optional<PlaceFinder> finder_;  // while the place is unknown
  std::optional<Timestamp> fixed_;     // frame of which the laser told the whole pose, the last one
  int unconfirmed_ = 0;                // frames in a row whose pose neither camera nor laser told
  BlindDrift drift_;
  std::unique_ptr<Executor> executor_;  // last: its jobs end before the rest goes
};

}  // namespace planar_vslam
