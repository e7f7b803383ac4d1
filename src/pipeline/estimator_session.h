#pragma once
// What an estimator knows of one drive in one map, from one start to the next. Internal.
#include <memory>
#include <optional>

#include "planar_vslam/pipeline/estimator.h"
#include "planar_vslam/pipeline/known_map.h"

namespace planar_vslam {

struct Estimator::Session {
  Session(const EstimatorSettings& settings, const MeasurementModel& model)
      : localization(
            std::make_unique<Localization>(settings.options, model, settings.schedule, settings.trajectory_frames)) {}

  void Count(const FrameReport& frame, const std::optional<PlanarMotion>& step);
  void Count(const MapChange& change, double max_scale_sigma);

  std::unique_ptr<Localization> localization;
  std::unique_ptr<Localization> own;  // waits for a map of its own while the loaded one is not seen
  std::unique_ptr<KnownMap> known;    // the loaded one, while the drive maps on its own beside it
  bool joined = false;                // with it, since the last frame
  bool seen = false;                  // a map, by the camera
  EstimatorReport report;
  bool slipping = false;  // the last frame was
  double distance = 0.0;  // m, driven by the wheels since the first frame
  Timestamp last_frame;
  std::unique_ptr<Mapping> mapping;  // while the map grows; last: its jobs end before the rest goes
};

}  // namespace planar_vslam
