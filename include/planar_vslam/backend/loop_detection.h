#pragma once
// The robot has come back to a place it mapped before, and the map does not show it there: the place is recognised.
//
// Of the keyframes the robot has driven a long way since (distance_driven.h), and may stand near by the map's
// uncertainty, those are tried whose landmarks look most like the newest keyframe's features. A place is taken for the
// same where
//   - PnP in RANSAC and a pose-only adjustment agree on many of its landmarks (place.h),
//   - and on enough of those that should be in view: buildings repeat themselves,
//   - the two keyframes before see them too, from where the map has them relative to the newest,
//   - and the map may be off that much: within `sigma_factor` times its standard deviation (map_uncertainty.h). A robot
//     that was kidnapped leaves a doubtful tie (map_ties.h), which makes the map that uncertain.
// Limits: place_limits.h.
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/geometry/option_fields.h"
#include "planar_vslam/optimize/map_drift.h"
#include "planar_vslam/recognition/place_limits.h"
#include "planar_vslam/recognition/projection_search.h"

namespace planar_vslam {

struct LoopOptions {
  bool enabled = true;  // the key `close`
  int min_inliers = 30;
  double min_share = 0.3;
  double sigma_factor = 4.0;

  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    constexpr int kFewest = 12;  // below, PnP finds a pose in any image
    v("close", o.enabled, "false: what has drifted apart stays apart");
    v("min_inliers", o.min_inliers, unit::kNone, bound::AtLeast(kFewest),
      "landmarks of the old place in the newest keyframe...");
    v("min_share", o.min_share, unit::kNone, bound::Between(0.0, 1.0), "...as a share of those that should be in view",
      Origin::kFitted);
    v("sigma_factor", o.sigma_factor, unit::kNone, bound::Positive(),
      "how many times its standard deviation the map may be off");
  }
  std::vector<std::string> Problems() const { return ProblemsOf(*this); }
};

// A keyframe as the landmarks of the old place put it.
struct LoopView {
  KeyframeId keyframe;
  Rigid3 T_map_base;
  FrameMatches matches;  // with old landmarks, inliers only
};

struct Loop {
  KeyframeId old;               // the keyframe of the old place that sees most of the same
  std::vector<LoopView> views;  // the newest keyframe first, then those before it
};

// `newest` is the last keyframe of `map`, which is metric, and which `drift` has followed.
std::optional<Loop> FindLoop(const Map& map, KeyframeId newest, const MapDrift& drift, const MeasurementModel& context,
                             const LoopOptions& options);

}  // namespace planar_vslam
