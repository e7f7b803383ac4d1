#pragma once
// The first map from two frames.
//  - kOdometry: the relative pose comes from wheel odometry and the extrinsics, so the map is metric at once; it waits
//    while the camera's baseline is short (the robot only rotates) and says what is missing.
//  - kVisual: homography or fundamental matrix, scale unknown: the median depth of the first map is 1. Where there is
//    odometry it waits for a motion that odometry can have made (motion_agreement.h).
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/geometry/two_view.h"
#include "planar_vslam/map/map.h"
#include "planar_vslam/optimize/bundle_adjustment.h"
#include "planar_vslam/planar/preintegration.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam {

enum class InitializationMode { kOdometry, kVisual };

struct InitializerOptions {
  InitializationMode mode = InitializationMode::kOdometry;
  int min_features = 100;  // keypoints in both frames
  int min_matches = 60;
  int min_points = 50;                                 // triangulated
  double min_parallax = DegreesToRadians(0.8);         // rad, of a point that counts
  double min_median_parallax = DegreesToRadians(1.0);  // rad, over the matches
  double min_baseline = 0.04;                          // m, between the cameras, by odometry where there is some
  double max_baseline_time = 8.0;                      // s, then a new first frame is taken
  double search_radius = 60.0;                         // px around the rotation-compensated position (odometry)
  double visual_search_radius = 100.0;                 // px (visual)
  double pixel_sigma = 1.0;                            // px

  std::vector<std::string> Problems() const;
};

struct InitializerInput {
  Timestamp stamp;
  FrameFeaturesPtr features;
  Rigid3 T_base_camera;
  std::optional<PlanarMotion> odometry;  // since the last input
};

struct InitializerReport {
  std::optional<Map> map;   // two keyframes, landmarks; metric with kOdometry
  std::string waiting_for;  // what is missing, for the user, while there is none
};

class Initializer {
 public:
  Initializer(const InitializerOptions& options, const MeasurementModel& bundle,
              const std::vector<double>& octave_scales)
      : options_(options), bundle_(bundle), octave_scales_(octave_scales) {}
  InitializerReport Add(const InitializerInput& input);

 private:
  struct First {
    Timestamp stamp;
    FrameFeaturesPtr features;
    Rigid3 T_base_camera;
    PlanarMotion odometry;  // from the first frame to the newest input
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
