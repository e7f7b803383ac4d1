#pragma once
// The map and how it grows. Tracked frames come in; the changes their keyframes make to the map come out
// some frames later. Owns the map as long as it grows; absent while a robot only localises.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/frontend/tracker.h"
#include "planar_vslam/pipeline/map_jobs.h"
#include "planar_vslam/pipeline/sweep_collector.h"
#include "planar_vslam/pipeline/synchronizer.h"
#include "planar_vslam/pipeline/trajectory_recorder.h"

namespace planar_vslam {

// A frame as tracking left it.
struct TrackedFrame {
  FrameFeaturesPtr features;
  std::optional<PlanarMotion> step;   // by odometry since the frame before
  TrackResult track;                  // where there was a map to track in
  std::optional<std::size_t> number;  // in the trajectory; nothing for a frame without a pose
  bool by_view_alone = false;         // the view told where it is, beside the wheels
};

class Mapping {
 public:
  // Grows `map`, which holds keyframes. `may_link`: the next keyframe may hang on the newest one by odometry, for
  // odometry is counted from it on. `wheels`: by what the odometry that comes is corrected.
  // `known`: another map that this one is to become one with (MapJobs); or none.
  Mapping(const MapJobsContext& context, std::shared_ptr<const Map> map, Schedule schedule, bool may_link,
          const WheelErrors& wheels, std::shared_ptr<const Map> known = nullptr);

  const std::shared_ptr<const Map>& map() const { return jobs_.map(); }
  // Free once the keyframe before is in the map.
  KeyframeSlot slot() const { return jobs_.busy() ? KeyframeSlot::kTaken : KeyframeSlot::kFree; }
  // While the map is not metric: what its scale waits for.
  const std::string& scale_missing() const { return scale_missing_; }

  // The first frames' sweeps wait like any other's.
  void AddSweeps(const FramePacket& packet, std::size_t number) { sweeps_.Add(packet, number); }
  // Takes what the frame says of the map; where it wants to be a keyframe and may, it becomes one: true.
  bool Add(const FramePacket& packet, TrackedFrame frame, const TrajectoryRecorder& trajectory);
  // The frame that is added next is there in the known map.
  void Meet(const Meeting& meeting) { jobs_.Meet(meeting); }
  // The robot was put somewhere else: odometry does not lead on from the last keyframe.
  void BreakMotion() { since_keyframe_.reset(); }
  // What its first images were given.
  void StartWithImageOffset(double offset) { image_offset_ = offset; }
  // Images are taken so many seconds after their stamps, by what is known now: those in the map follow where they are
  // off by `worth`, and the map is adjusted as a whole.
  void FollowImageOffset(double offset, double worth);
  // Changes since the last call, in their order; `wait`: until nothing is left to do.
  std::vector<MapChange> Collect(bool wait);
  // At least as thoroughly as the map is adjusted in the end; as soon as the searcher is free.
  void AdjustWholeMap();
  // Takes the sweeps that wait, and adjusts the map as a whole where `adjust`. After Collect(true). The reason where
  // the adjustment fails; the sweeps are in the map all the same.
  Expected<MapChange> Finish(const TrajectoryRecorder& trajectory, bool adjust);

 private:
  void Propose(const FramePacket& packet, TrackedFrame frame, const TrajectoryRecorder& trajectory);
  void CountSightingsOf(const FrameMatches& matches);
  void TryScaleRecovery(const MapChange& change);
  int FinalIterations() const;

  const MapJobsContext context_;
  const KeyframeId session_begin_;              // the first keyframe that is not of a map before
  std::optional<PlanarMotion> since_keyframe_;  // by odometry; nothing where that does not lead here
  CountSightings sightings_;                    // since the last proposal
  SweepCollector sweeps_;
  ScaleGate scale_gate_;
  std::string scale_missing_;
  double image_offset_ = 0.0;  // s, of the map's images
  MapJobs jobs_;               // last: its jobs end before the rest goes
};

}  // namespace planar_vslam
