#pragma once
// Where the robot is: extracts features, finds the pose of each frame in the map, records the trajectory. Knows the map
// as a snapshot that never changes, and adopts the changes it is told of.
#include <memory>
#include <optional>

#include "planar_vslam/feature/orb_extractor.h"
#include "planar_vslam/frontend/initializer.h"
#include "planar_vslam/frontend/tracker.h"
#include "planar_vslam/pipeline/early_frames.h"
#include "planar_vslam/pipeline/frame_report.h"
#include "planar_vslam/pipeline/image_timing.h"
#include "planar_vslam/pipeline/laser_slip.h"
#include "planar_vslam/pipeline/map_accuracy.h"
#include "planar_vslam/pipeline/map_change.h"
#include "planar_vslam/pipeline/mapping.h"
#include "planar_vslam/pipeline/options.h"
#include "planar_vslam/pipeline/pose_slew.h"
#include "planar_vslam/pipeline/relocalizer.h"
#include "planar_vslam/pipeline/synchronizer.h"
#include "planar_vslam/pipeline/trajectory_recorder.h"

namespace planar_vslam {

class Localization {
 public:
  // There is no map: the first frames make one. `schedule`: where a place is searched for. `trajectory_frames`: how
  // many frames are remembered; 0: all.
  Localization(const PipelineOptions& options, const MeasurementModel& model, Schedule schedule,
               std::size_t trajectory_frames);

  // A map that the first frames make has its ids above those of this one.
  void NumberAbove(std::shared_ptr<const Map> below) { beginning_.below = std::move(below); }
  // Where a map that the next frame makes is to have it; nothing: where its first keyframe is the origin.
  void ExpectAt(const std::optional<Rigid3>& T_map_base) { beginning_.T_map_base = T_map_base; }
  // Finds frames in `map` from now on, wherever in it they are.
  void StartIn(std::shared_ptr<const Map> map);
  // The next frame is at `T_map_base`, with this covariance (right tangent [translation, rotation]). There is a map.
  void StartAt(const Rigid3& T_map_base, const Matrix6d& covariance);
  // The map stays as it is from now on: its sweeps tell poses.
  void UseSweeps() { relocalizer_.UseSweeps(*known_.map); }
  // Adopts a changed map.
  void Follow(const MapChange& change);

  // The pose of the packet's frame. While there is no map a new one may come of it, which `new_map` is given; it counts
  // from then on. Where `new_map` is null, frames wait for a map. Fills in the report but for T_map_odom, keyframe and
  // total_ms. `features` of the image, where somebody who has a map has extracted them; else null.
  TrackedFrame Locate(const FramePacket& packet, KeyframeSlot slot, FrameReport* report,
                      std::shared_ptr<const Map>* new_map, FrameFeaturesPtr features = nullptr);

  // The last frame's base on the floor of the map as it is now; nothing while frames have no pose.
  std::optional<PlanarFix> LastFix() const;
  const std::shared_ptr<const Map>& map() const { return known_.map; }
  const TrajectoryRecorder& trajectory() const { return trajectory_; }
  // By how much an image's rows seem to take longer than configured (image_timing.h).
  std::optional<Deviation> MissedReadout() const { return images_.timing.MissedReadout(); }

 private:
  void FollowImages(const MapChange& change);
  std::shared_ptr<const Map> Initialize(const FramePacket& packet, TrackedFrame* frame, FrameReport* report);
  void Track(const FramePacket& packet, KeyframeSlot slot, TrackedFrame* frame, FrameReport* report);
  // Wheels that slip while a map grows and nothing is seen of it, as the laser tells.
  void CheckSlip(const FramePacket& packet, PlanarMotion* step, FrameReport* report);
  void Record(const FramePacket& packet, bool was_localized, TrackedFrame* frame);
  // Where the place is unknown: whether it has become clear. Frames go on from there.
  bool FindPlace(const FramePacket& packet, const TrackedFrame& frame, bool map_grows);
  // Frames go on from there.
  void GoOnFrom(const Rigid3& T_map_base, const Matrix6d& covariance);
  // The view of a frame that was not found goes to what is known of its place; one that was found there is held against
  // it, and refused where the laser sees another place.
  void WeighView(const FramePacket& packet, bool was_localized, TrackedFrame* frame);
  // A first pose that the camera found may be off by what was moved in its view: once more from where the laser puts
  // it. Whether it does.
  bool SettleByLaser(const FramePacket& packet, TrackInput* input, TrackedFrame* frame);
  // The pose as it is published, in a map that stays as it is.
  void Slew(const std::optional<PlanarMotion>& step, FrameReport* report);
  CameraView ViewOf(const FramePacket& packet, const TrackedFrame& frame) const;

  const MeasurementModel model_;
  struct Images {
    int feature_count;
    OrbExtractor extractor;
    ImageTiming timing;
  } images_;
  struct Beginning {  // of a map
    Initializer initializer;
    EarlyFrames early;                 // from before the first pose
    std::shared_ptr<const Map> below;  // whose ids a new map's are above; none: they begin with 0
    std::optional<Rigid3>
        T_map_base;  // where a new map is to have the frame that makes it; none: its first is the origin
  } beginning_;
  Tracker tracker_;
  struct Known {
    std::shared_ptr<const Map> map;
    std::optional<KeyframeAccuracy> accuracy;
    WheelNoise wheel_noise;
    MountUncertainty mount;
  } known_;
  TrajectoryRecorder trajectory_;
  Relocalizer relocalizer_;
  LaserSlip laser_slip_;
  PoseSlew slew_;
  struct {
    Rigid3 T_map_base;
    Timestamp stamp;
    Matrix6d covariance = Matrix6d::Zero();  // without that of the map
    Timestamp leads_from;                    // stamp from which on poses lead to it without a jump
    bool blind = false;                      // the wheels alone told its pose
  } last_;                                   // frame with a pose
};

}  // namespace planar_vslam
