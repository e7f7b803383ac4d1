#pragma once
// Laser sweeps on their way into the map: each waits with the frame it was taken near until the map is metric, then
// goes to that frame's keyframe. Sweeps from where the last one was kept say nothing new and are dropped.
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "planar_vslam/map/map_edit.h"
#include "planar_vslam/pipeline/synchronizer.h"
#include "planar_vslam/pipeline/trajectory_recorder.h"

namespace planar_vslam {

class SweepCollector {
 public:
  // `frame`: number of the packet's frame in the recorded trajectory.
  void Add(const FramePacket& packet, std::size_t frame);
  // The last waiting sweep, in the base at `T_odom_base`, if it was taken at most 0.3 s before `stamp`: the own one of
  // a keyframe made there, placed by odometry alone. It waits no more.
  std::optional<LaserSweep> TakeLatest(const Rigid2& T_odom_base, Timestamp stamp);
  // What waits with frames on odometry is dropped: their poses turned out to be wrong.
  void DropOnOdometry(const TrajectoryRecorder& trajectory);
  // What waits, one edit a keyframe; nothing while the map is not metric. Sweeps of frames on odometry wait on, unless
  // `all` are wanted, for the keyframe that those will hang on.
  std::vector<AddSweeps> Take(const Map& map, const TrajectoryRecorder& trajectory, bool all);

 private:
  struct Waiting {
    std::shared_ptr<const PlanarScan> scan;
    Rigid3 T_base_laser;
    Rigid2 T_frame_base;
    Rigid2 T_odom_base;
    std::size_t frame = 0;
  };
  bool IsNew(const Rigid2& T_odom_base);

  std::vector<Waiting> waiting_;
  std::optional<Rigid2> last_kept_;  // T_odom_base
  int kept_here_ = 0;
};

}  // namespace planar_vslam
