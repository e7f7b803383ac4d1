#pragma once
// The estimator's front door: measurements and commands in, reports out. The command line and the node both use it so:
//
//   Estimator estimator(settings);                            // camera and options, both without Problems()
//   estimator.LoadMap(saved);                                 // or not: the first frames then make a map
//   for (measurement : in order of arrival)                   // CameraFrame, OdometryReading or LaserFrame
//     for (const FrameReport& report : estimator.Add(measurement)) ...
//   for (const FrameReport& report : estimator.Flush()) ...   // no more input: images that still wait are used
//   estimator.Finish();                                       // pending jobs, and the whole map adjusted
//   estimator.Snapshot();                                     // map, trajectory, camera: at any time
//
// Between measurements commands may come at any time: LoadMap, SetMode, StartAt, AdjustMap, Restart. One that cannot be
// carried out is an Error of one line and changes nothing. One thread calls; no call waits for a job but Finish,
// SetMode and the destructor.
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/map/map_file.h"
#include "planar_vslam/pipeline/executor.h"
#include "planar_vslam/pipeline/frame_report.h"
#include "planar_vslam/pipeline/frame_view.h"
#include "planar_vslam/pipeline/image_clock.h"
#include "planar_vslam/pipeline/input_corrector.h"
#include "planar_vslam/pipeline/input_watch.h"
#include "planar_vslam/pipeline/localization.h"
#include "planar_vslam/pipeline/mapping.h"
#include "planar_vslam/pipeline/odometry_continuity.h"
#include "planar_vslam/pipeline/options.h"
#include "planar_vslam/pipeline/synchronizer.h"

namespace planar_vslam {

struct EstimatorSettings {
  PipelineOptions options;
  CameraModel camera;
  bool has_base = true;  // where the camera is on the base is known; else base is the camera, and there is no floor
  bool with_odometry = true;  // images wait for odometry; else it is ignored, sweeps too, and a map starts visually
  Schedule schedule = Schedule::kInline;
  std::size_t trajectory_frames = 0;  // frames whose poses are remembered, the latest ones; 0: all
};

// Values another thread may keep.
struct EstimatorSnapshot {
  std::shared_ptr<const Map> map;  // never null
  TrajectoryRecorder trajectory;
  CameraModel camera;  // that made the map
  Timestamp stamp;     // of the last frame
};

class Estimator {
 public:
  explicit Estimator(const EstimatorSettings& settings);
  ~Estimator();
  Estimator(const Estimator&) = delete;
  Estimator& operator=(const Estimator&) = delete;

  // Reports of the frames that this measurement completes: an image waits until odometry covers it.
  std::vector<FrameReport> Add(CameraFrame frame);
  std::vector<FrameReport> Add(const OdometryReading& reading);
  std::vector<FrameReport> Add(LaserFrame frame);
  std::vector<FrameReport> Flush();
  // Waits for what is under way, then adjusts the whole map unless the options say not to, or it is only localised in.
  // The reason where that fails: the map is then as before the adjustment.
  Expected<bool> Finish();

  // Starts over in `saved`: frames have no pose until one is recognised. In mode mapping it needs the same camera.
  Expected<bool> LoadMap(const SavedMap& saved);
  // Mapping lets the map grow, localization leaves it as it is; tracking goes on. Waits for jobs under way, which the
  // map would miss.
  Expected<bool> SetMode(RunMode mode);
  // The robot is at `T_map_base` now, as a user or another system says; covariance of the right tangent [translation,
  // rotation], in which height and tilt may be zero.
  Expected<bool> StartAt(const Rigid3& T_map_base, const Matrix6d& covariance);
  // The whole map is adjusted next, in the background where the schedule has one.
  Expected<bool> AdjustMap();
  // Drops poses, map and measurements that wait, and starts over: in the map that was loaded or localised in last, or
  // in none.
  void Restart();

  std::shared_ptr<const Map> map() const;
  const CameraModel& map_camera() const { return map_camera_; }  // that made the map
  RunMode mode() const { return mode_; }
  const EstimatorSettings& settings() const { return settings_; }
  const MeasurementModel& model() const { return model_; }
  const EstimatorReport& report() const;
  const TrajectoryRecorder& trajectory() const;
  const FrameView& view() const { return view_; }  // of the last frame
  // Nothing while there is no map.
  std::optional<EstimatorSnapshot> Snapshot() const;
  // How many images wait for odometry.
  std::size_t images_waiting() const { return input_->synchronizer.images_waiting(); }
  // Input that could not be used, by reason.
  std::map<std::string, long> unused_input() const;
  // What has come in since the start, or the last restart.
  const InputWatch& input_watch() const { return input_->watch; }

 private:
  // Measurements on their way in.
  struct Input {
    explicit Input(const EstimatorSettings& settings);
    InputWatch watch;
    OdometryContinuity continuity;
    InputCorrector corrector;
    ImageClock clock;
    Synchronizer synchronizer;
    OdometryBuffer wheels;  // the odometry frame as its source has it, on the camera's clock: for T_map_odom
  };
  // All that starts over with a map.
  struct Session;

  std::vector<FrameReport> Drain();
  FrameReport Process(const FramePacket& packet);
  void WatchClock(const FramePacket& packet, const TrackedFrame& frame);
  void FollowMap(bool wait, StageTimes* times);
  void WaitForMap();
  void FollowSweeps();
  void StartSession(std::shared_ptr<const Map> map);
  // Whether the robot has driven on and its camera has seen nothing of the loaded map.
  bool MayMapOnItsOwn() const;
  // Makes a map beside the loaded one, as soon as images allow: frame, report and new map are of that from then on.
  void StartOwnMap(const FramePacket& packet, TrackedFrame* frame, FrameReport* report,
                   std::shared_ptr<const Map>* new_map);
  void StartMapping(std::shared_ptr<const Map> map, bool may_link);
  Expected<bool> MayGrow(const CameraModel& camera) const;

  const EstimatorSettings settings_;
  const MeasurementModel model_;
  RunMode mode_;
  std::shared_ptr<const Map> loaded_map_;  // what sessions start in; null: nothing
  CameraModel map_camera_;                 // that made the map
  std::unique_ptr<Input> input_;
  std::unique_ptr<Session> session_;
  FrameView view_;
  std::unique_ptr<Executor> retiring_;  // ends what has jobs of its own, once it is not used any more
};

}  // namespace planar_vslam
