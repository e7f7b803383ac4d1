#pragma once
// What the estimator says: of every frame, and of the run so far.
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "planar_vslam/backend/look_back.h"
#include "planar_vslam/frontend/tracking_state.h"
#include "planar_vslam/geometry/rigid2.h"
#include "planar_vslam/geometry/rigid3.h"
#include "planar_vslam/geometry/stopwatch.h"
#include "planar_vslam/pipeline/map_scale.h"
#include "planar_vslam/pipeline/stage_statistics.h"
#include "planar_vslam/pipeline/synchronizer.h"
#include "planar_vslam/pipeline/wheel_check.h"
#include "planar_vslam/pipeline/wheel_errors.h"

namespace planar_vslam {

struct FrameReport {
  Timestamp stamp;
  TrackingState state = TrackingState::kInitializing;
  std::optional<Rigid3> T_map_base;            // of a metric map, or of an unscaled one when `metric` is false
  Matrix6d covariance = Matrix6d::Identity();  // tangent [translation, rotation] at the pose
  // Where the odometry frame, as its source gives it, lies on the floor of the map. The base is projected, not the
  // frame: that one tilts about an origin far away.
  std::optional<Rigid2> T_map_odom;
  Rigid2 T_base_exposed;  // the base when the image was taken, in the base at its stamp, by what is known of its clock
  bool metric = false;
  int inliers = 0;
  bool keyframe = false;
  bool odometry_rejected = false;
  bool joined = false;  // the drive's own map became one with the loaded one: from this frame on `map` is that one's
  std::string waiting_for;  // while there is no pose, or no metric one: what is missing
  StageTimes times;         // of this frame, and of mapping jobs collected with it
  double total_ms = 0.0;    // that the caller waited
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

struct LoopReport {
  ClosedLoop closed;
  Timestamp keyframe;  // of the keyframe that closed it
  Timestamp in_map;    // of the frame after which the map showed it
};

// How the map of a drive whose start was not recognised became one with the map that was loaded.
struct JoinReport {
  Rigid3 T_known_own;          // where the drive's map lies in the other...
  Eigen::Matrix3d covariance;  // ...of a right perturbation [x, y, angle]
  int places = 0;              // apart from each other, in which both agree
  Timestamp keyframe;          // the newest one then
  Timestamp in_map;            // the frame after which the map showed it
};

struct EstimatorReport {
  std::map<TrackingState, long> frames;
  long keyframes_made = 0, keyframes_culled = 0;
  std::vector<LoopReport> loops;
  bool own_map = false;              // the start was not recognised in the map that was loaded...
  std::optional<JoinReport> joined;  // ...and the map that the drive made became one with it
  long odometry_rejected = 0;
  std::optional<ImageOffset> image_offset;  // s, where turns have told something of it
  std::optional<Deviation> missed_readout;  // s, by how much an image's rows take longer than configured
  long slips = 0;                           // times the wheels went another way than the view
  std::optional<ScaleReport> scale;         // only where the map was scaled
  MapScale map_scale;                       // of the map as it is now
  WheelErrors wheels;                       // by what odometry is corrected now
  std::optional<double> scale_known_after;  // m driven until its standard deviation was good enough
  std::optional<Timestamp> initialized;     // first frame with a map
  // Frames whose odometry had its covariance from the noise model, or all of it from messages.
  long odometry_by_model = 0, odometry_by_messages = 0;
  long adjustments = 0, adjustment_iterations = 0;  // bundle adjustments of a neighbourhood or the whole map
  // Adjustments of the map that failed and left it as it was, by what the solver said.
  std::map<std::string, long> failed_adjustments;
  StageStatistics stages;
};

}  // namespace planar_vslam
