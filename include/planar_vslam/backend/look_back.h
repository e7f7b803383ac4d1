#pragma once
// What a keyframe that has been mapped tells about the map as a whole: how well the map knows where it stands, and
// whether the robot has come back to a place it mapped before (loop_closing.h). A job of its own on a snapshot, long
// where a loop is closed: the map may move on meanwhile (map_correction.h).
#include <memory>
#include <optional>
#include <string>

#include "planar_vslam/backend/map_correction.h"
#include "planar_vslam/backend/map_keyframe.h"
#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/geometry/stopwatch.h"

namespace planar_vslam {

struct ClosedLoop {
  KeyframeId old;         // keyframe of the place that was recognised
  Rigid3 T_before_after;  // how far the newest keyframe was off, and the map with it
};

struct LoopClosure {
  ClosedLoop loop;
  std::shared_ptr<const Map> map;  // the snapshot with the loop closed
  MapCorrection correction;        // from the snapshot to `map`, for a map that has moved on
  BundleSummary bundle;            // the adjustment of the whole map
};

struct LookBackOutcome {
  KeyframeId keyframe;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // of its pose in the map (map_uncertainty.h), a loop closed
  std::optional<LoopClosure> closed;
  std::string failure;  // why a loop that was found could not be closed: the map stays as it is
  StageTimes times;     // "loop.ties", "loop.covariance", "loop.search", "loop.close"
};

// `newest` is the last keyframe of `snapshot`. In a map that is not metric there is nothing to see: covariance zero.
// `drift` follows the map from one call to the next.
LookBackOutcome LookBack(const Map& snapshot, KeyframeId newest, const MapperContext& context, MapDrift* drift);

struct AdjustedMap {
  Map map;
  MapCorrection correction;  // for a map that has moved on
  BundleSummary bundle;      // with times
};

// Bundle adjustment of the whole map, up to three times where keyframes turn out to stand off the floor; a map with
// nothing to adjust is returned as it is. Error: what Ceres says where it finds no solution.
Expected<AdjustedMap> AdjustWholeMap(const Map& map, const MeasurementModel& model);

}  // namespace planar_vslam
