#pragma once
// The first map from two frames.
//  - kOdometry: the relative pose comes from wheel odometry and the extrinsics, so the map is metric at once; it waits
//    while the camera's baseline is short (the robot only rotates) and says what is missing.
//  - kVisual: homography or fundamental matrix, scale unknown: the median depth of the first map is 1. Where there is
//    odometry it waits for a motion that odometry can have made (motion_agreement.h).
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/geometry/option_fields.h"
#include "planar_vslam/geometry/two_view.h"
#include "planar_vslam/map/map.h"
#include "planar_vslam/optimize/bundle_adjustment.h"
#include "planar_vslam/planar/preintegration.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam {

enum class InitializationMode { kOdometry, kVisual };

struct InitializerOptions {
  InitializationMode mode = InitializationMode::kOdometry;  // the key `init`
  int min_features = 100;
  int min_matches = 60;
  int min_points = 50;
  double min_parallax = DegreesToRadians(0.8);
  double min_median_parallax = DegreesToRadians(1.0);
  double min_baseline = 0.04;
  double max_baseline_time = 8.0;
  double search_radius = 60.0;
  double visual_search_radius = 100.0;

  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    constexpr int kFewest = 8;  // a fundamental matrix needs as many
    const Bound acute = bound::Between(0.0, 90.0);
    v("min_features", o.min_features, unit::kNone, bound::AtLeast(kFewest), "keypoints in both images");
    v("min_matches", o.min_matches, unit::kNone, bound::AtLeast(kFewest), "between them");
    v("min_points", o.min_points, unit::kNone, bound::AtLeast(kFewest), "triangulated");
    v("min_parallax_deg", o.min_parallax, unit::kDegrees, acute,
      "of a point that counts, where a keypoint's noise is 1/610 of the focal length; else in proportion to it...");
    v("min_median_parallax_deg", o.min_median_parallax, unit::kDegrees, acute, "...and over the matches");
    v("min_baseline", o.min_baseline, unit::kMeters, bound::Positive(),
      "between the cameras, by odometry where there is some");
    v("max_baseline_time", o.max_baseline_time, unit::kSeconds, bound::Positive(), "then a new first image is taken");
    v("search_radius", o.search_radius, unit::kPixels, bound::Positive(),
      "around the rotation-compensated position (odometry)");
    v("visual_search_radius", o.visual_search_radius, unit::kPixels, bound::Positive(), "the same without odometry");
  }
  std::vector<std::string> Problems() const { return ProblemsOf(*this); }
};

struct InitializerInput {
  Timestamp stamp;
  FrameFeaturesPtr features;
  Rigid3 T_base_camera;
  std::optional<PlanarMotion> odometry;  // since the last input
  ImageMoment moment = {};
};

struct InitializerReport {
  std::optional<Map> map;   // two keyframes, landmarks; metric with kOdometry
  std::string waiting_for;  // what is missing, for the user, while there is none
};

class Initializer {
 public:
  Initializer(const InitializerOptions& options, const MeasurementModel& bundle,
              const std::vector<double>& octave_scales);
  InitializerReport Add(const InitializerInput& input);

 private:
  struct First {
    Timestamp stamp;
    FrameFeaturesPtr features;
    Rigid3 T_base_camera;
    PlanarMotion odometry;  // from the first frame to the newest input
    ImageMoment moment = {};
  };
  InitializerReport Restart(const InitializerInput& input, std::string reason);
  Rigid3 CameraMotionByOdometry(const InitializerInput& input) const;
  InitializerReport TryOdometry(const InitializerInput& input);
  InitializerReport TryVisual(const InitializerInput& input);
  // `points` per match in the first camera's frame.
  InitializerReport Finish(const InitializerInput& input, const Rigid3& T_camera1_camera2,
                           const std::vector<std::pair<int, int>>& matches,
                           const std::vector<std::optional<Eigen::Vector3d>>& points, bool metric);

  InitializerOptions options_;
  MeasurementModel bundle_;
  std::vector<double> octave_scales_;
  std::optional<First> first_;
};

}  // namespace planar_vslam
