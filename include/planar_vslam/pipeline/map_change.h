#pragma once
// How the map has changed: what those who use it have to follow.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/backend/map_keyframe.h"
#include "planar_vslam/pipeline/frame_report.h"
#include "planar_vslam/pipeline/map_accuracy.h"
#include "planar_vslam/pipeline/wheel_errors.h"

namespace planar_vslam {

struct MapChange {
  struct NewKeyframe {
    KeyframeId id;
    Timestamp stamp;
    Rigid3 T_map_base_proposed;  // of its frame, in the map of that moment
  };

  std::shared_ptr<const Map> map;  // as it is now; never null
  std::optional<NewKeyframe> keyframe;
  std::vector<CulledKeyframe> keyframes_culled;
  std::optional<ScaleReport> scaled;  // it became metric
  std::optional<LoopReport> loop;     // it was bent; `in_map` is the follower's to say
  std::optional<JoinReport> joined;   // it became one with the known map; `in_map` is the follower's to say
  std::optional<MapScale> scale;      // how well its scale is known now
  std::optional<KeyframeAccuracy> accuracy;
  std::optional<WheelErrors> wheels;   // what the wheels read wrong: its links are corrected by that now
  std::optional<double> image_offset;  // s, of all its images now (SetImageOffset)
  int bundle_iterations = 0;
  std::string failure;  // of an adjustment, which left the map as it was
  StageTimes times;     // of the job
};

}  // namespace planar_vslam
