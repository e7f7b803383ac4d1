#pragma once
// The whole estimator: a packet in, a pose out; keyframes, map and scale behind it.
#include <array>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/frontend/initializer.h"
#include "planar_vslam/frontend/tracker.h"
#include "planar_vslam/frontend/tracking_state.h"
#include "planar_vslam/map/map_file.h"
#include "planar_vslam/pipeline/executor.h"
#include "planar_vslam/pipeline/options.h"
#include "planar_vslam/pipeline/sweep_collector.h"
#include "planar_vslam/pipeline/synchronizer.h"
#include "planar_vslam/pipeline/trajectory_recorder.h"

namespace planar_vslam {

struct FrameReport {
  Timestamp stamp;
  TrackingState state = TrackingState::kInitializing;
  std::optional<Rigid3> T_map_base;            // of a metric map, or of an unscaled one when `metric` is false
  Matrix6d covariance = Matrix6d::Identity();  // tangent [translation, rotation] at the pose
  bool metric = false;
  int inliers = 0;
  bool keyframe = false;
  bool odometry_rejected = false;
  std::string waiting_for;  // while there is no pose, or no metric one: what is missing
  double extract_ms = 0.0, track_ms = 0.0, map_ms = 0.0, total_ms = 0.0;
};

// How an unscaled map was made metric.
struct ScaleReport {
  double by_steps = 0.0;                                       // the paper's ratio
  double by_centroids = 0.0;                                   // Horn's
  double applied = 0.0;                                        // by all sources, see map_scale.h
  std::vector<std::pair<Timestamp, Rigid3>> unscaled_cameras;  // T_map_camera of the keyframes it was recovered from
  KeyframeId keyframe;                                         // the newest one at that moment
  Timestamp stamp;
};

struct SystemReport {
  std::map<TrackingState, long> frames;
  long keyframes_made = 0, keyframes_culled = 0;
  std::vector<std::pair<Timestamp, ClosedLoop>> loops;  // by the keyframe that closed it
  long odometry_rejected = 0;
  long slips = 0;                           // times the wheels went another way than the view
  std::optional<ScaleReport> scale;         // only where the map was scaled
  MapScale map_scale;                       // of the map as it is now
  std::optional<double> scale_known_after;  // m driven until its standard deviation was good enough
  std::optional<Timestamp> initialized;     // first frame with a map
  // Frames whose odometry had its covariance from the noise model, or all of it from messages.
  long odometry_by_model = 0, odometry_by_messages = 0;
};

enum class Schedule { kInline, kThreaded };

class SlamSystem {
 public:
  // `camera` and `options` must have no Problems().
  SlamSystem(const PipelineOptions& options, const CameraModel& camera, bool has_base_transform, Schedule schedule);
  ~SlamSystem();
  SlamSystem(const SlamSystem&) = delete;
  SlamSystem& operator=(const SlamSystem&) = delete;

  // Starts from a saved map instead of making the first one; before the first Process(). Frames have no pose until one
  // is recognised in it. Problems, one line each, where map and camera or options do not fit together: nothing is done.
  std::vector<std::string> StartFrom(const SavedMap& saved);

  FrameReport Process(const FramePacket& packet);
  // Waits for pending work, then adjusts the whole map (unless the options say not to).
  void Finish();

  std::shared_ptr<const Map> map() const { return map_; }
  const PipelineOptions& options() const { return options_; }
  const MeasurementModel& bundle() const { return bundle_; }
  const SystemReport& report() const { return report_; }
  const TrajectoryRecorder& trajectory() const { return trajectory_; }
  // Drops map and trajectory and starts over: from the saved map where there was one.
  void Reset();

 private:
  struct Pending {
    std::future<MappingOutcome> outcome;
    Timestamp stamp;
    Rigid3 T_map_base;  // of the proposing frame, in the snapshot of that moment
  };
  // A frame from before the first pose: odometry places it once there is one.
  struct EarlyFrame {
    Timestamp stamp;
    Rigid3 T_base_camera;
    std::optional<PlanarMotion> step;  // since the frame before
  };
  void Initialize(const FramePacket& packet, const FrameFeaturesPtr& features, const std::optional<PlanarMotion>& step,
                  FrameReport* report);
  void TrackFrame(const FramePacket& packet, const FrameFeaturesPtr& features, const std::optional<PlanarMotion>& step,
                  FrameReport* report);
  void Propose(const FramePacket& packet, const FrameFeaturesPtr& features, TrackResult result);
  void PlaceEarlyFrames();
  void PlaceFramesBefore(const TrackResult& result);
  void CollectMapping(bool wait);
  void AddSinceKeyframe(const std::optional<PlanarMotion>& step, const TrackResult& result);
  Matrix6d CovarianceOfMapAt(const Rigid3& T_map_base) const;
  void AssessMapScale();
  void TryScaleRecovery(Timestamp stamp);
  void ApplyScale(Timestamp stamp, double log_scale);
  bool localizing() const { return options_.mode == RunMode::kLocalization; }

  PipelineOptions options_;
  CameraModel camera_;
  MeasurementModel bundle_;
  OrbExtractor extractor_;
  Initializer initializer_;
  Tracker tracker_;
  std::unique_ptr<Executor> executor_;
  std::shared_ptr<const Map> map_;
  std::optional<Pending> pending_;
  std::optional<PlanarMotion> since_keyframe_;
  CountSightings sightings_;
  TrajectoryRecorder trajectory_;
  std::vector<EarlyFrame> before_map_;
  SweepCollector sweeps_;
  std::shared_ptr<const Map> saved_map_;  // the run started from
  SystemReport report_;
  ScaleGate scale_gate_;
  std::string scale_missing_;  // while the map is not metric: what its scale waits for
  bool slipping_ = false;      // the last frame was
  double distance_ = 0.0;      // m, driven by the wheels since the first frame
  Rigid3 T_map_base_last_;
  KeyframeId covariance_of_;                                       // keyframe whose pose in the map has...
  Eigen::Matrix3d keyframe_covariance_ = Eigen::Matrix3d::Zero();  // ...this covariance, right tangent [x, y, angle]
};

}  // namespace planar_vslam
