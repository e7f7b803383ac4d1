#pragma once
// Bundle adjustment over part of a map or all of it:
//   sum rho_cauchy(|e_reprojection|^2 / sigma^2) + sum |e_planar|^2
//     + sum [rho_cauchy(|e_odometry x,y,yaw|^2_Sigma) + rho_cauchy(|e_odometry z,roll,pitch|^2_Sigma)]
// over base poses T_map_base (camera through T_base_camera at that stamp) and points. Values in, values out.
// e_planar of a pose off the floor, and a link from or to one, leave it what slopes are (planar.sigma_slope).
// With planar.mode se2_xyz or hard, free keyframes on the floor are put on it and keep 3 dof, without e_planar; with
// se2_xyz the reprojections of all keyframes on the floor are weighted by planar_reprojection_factor.h, anew a round.
#include <atomic>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "planar_vslam/geometry/option_fields.h"
#include "planar_vslam/geometry/stopwatch.h"
#include "planar_vslam/map/map.h"
#include "planar_vslam/map/map_edit.h"
#include "planar_vslam/planar/odometry_noise.h"
#include "planar_vslam/planar/planar_prior.h"
#include "planar_vslam/sensor/camera_model.h"

namespace planar_vslam {

struct BundleOptions {
  int max_iterations = 5;
  double relative_gain = 1e-3;
  bool drop_outliers = true;
  // Cauchy, sigmas. Of what is no outlier a tenth still slides along edges, shadows and reflections, by a pixel or two
  // that all its views agree upon; in a hall, where few landmarks hold a pose, these would bend the map.
  double pixel_loss = 1.5;
  // Cauchy, Mahalanobis norms of the two parts of a link (relative_pose_factor.h): what slipped pulls at nothing, and
  // what is not level (a ramp, a car that pitches) is no slip.
  double odometry_loss = 5.0;  // x, y and yaw
  double tilt_loss = 3.5;      // height, roll and pitch
  bool use_odometry = true;

  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    v("max_iterations", o.max_iterations, unit::kNone, bound::AtLeast(1), "of each of its two rounds");
    v("relative_gain", o.relative_gain, unit::kNone, bound::AtLeast(0.0),
      "of the cost by one step, below which the adjustment of a neighbourhood ends", Origin::kFitted);
    v("drop_outliers", o.drop_outliers, "second round without observations beyond the 95 % limit, where there are any");
    v("pixel_loss", o.pixel_loss, unit::kNone, bound::Positive(),
      "standard deviations of a pixel beyond which an observation counts less", Origin::kFitted);
    v("odometry_loss", o.odometry_loss, unit::kNone, bound::Positive(),
      "Mahalanobis norm beyond which a link of wheels or laser counts less", Origin::kFitted);
    v("tilt_loss", o.tilt_loss, unit::kNone, bound::Positive(),
      "the same for a link's height, roll and pitch, which the floor bounds", Origin::kFitted);
    v("use_odometry", o.use_odometry, "odometry links between keyframes take part");
  }
  std::vector<std::string> Problems() const { return ProblemsOf(*this); }
};

struct BundleRequest {
  std::vector<KeyframeId> free_keyframes;   // ascending
  std::vector<KeyframeId> fixed_keyframes;  // ascending, disjoint from the free ones
  std::vector<LandmarkId> landmarks;        // ascending; observations in other keyframes are left out
  // One of the fixed ones, or invalid: the map hangs on its x, y and yaw. The floor prior knows its height and tilt as
  // well as those of any other, and a camera that sways does not stand level because its keyframe is the first. It is
  // held where it would tip by more than planar.sigma_tilt: then others stand on a ramp.
  KeyframeId origin;
};

// What is known of the sensors and how they err.
struct MeasurementModel {
  CameraModel camera;
  OdometryNoise odometry_noise;
  PlanarPriorOptions planar;  // applied to keyframes on the floor of a metric map, unless its mode is off
  BundleOptions options;
  double pixel_sigma = 1.0;      // px, of a keypoint at full resolution (octave 0); grows with the octave's scale
  MotionFloor laser_floor = {};  // of motion by matched sweeps
};

struct BundleSummary {
  bool converged = false;        // usable solution
  std::string message;           // why not, or what ended the iterations
  std::size_t observations = 0;  // that took part; none where there was nothing to adjust
  double initial_cost = 0.0, final_cost = 0.0;
  int iterations = 0;  // of both rounds
  // Of both rounds: "bundle.build", "bundle.residuals", "bundle.jacobians", "bundle.linear_solver", "bundle.classify";
  // Ceres has "bundle.preprocess" and "bundle.other" as well.
  StageTimes times;

  bool failed() const { return observations > 0 && !converged; }
};

// Without values unless converged.
struct BundleResult : BundleSummary {
  std::vector<std::pair<KeyframeId, Rigid3>> poses;
  std::vector<std::pair<LandmarkId, Eigen::Vector3d>> points;
  std::vector<std::pair<LandmarkId, KeyframeId>> outliers;  // observations beyond the limit, or behind the camera
};

enum class BundleSolver {
  kSchur,  // a solver of its own for a neighbourhood: dense, fast up to some forty free keyframes
  kCeres,  // for whole maps: sparse beyond about sixty free keyframes
};

// Deterministic: one thread, sums in the order of ids. Once `hurry` is set, by another thread, kSchur ends with the
// iteration at work: somebody waits.
BundleResult AdjustBundle(const Map& map, const BundleRequest& request, const MeasurementModel& context,
                          BundleSolver solver, const std::atomic<bool>* hurry = nullptr);

// The result as changes to the map: poses, points, outlier observations erased.
MapEdit ToEdit(const BundleResult& result);

// All keyframes and landmarks, the first keyframe fixed. Without a metric odometry factor also the second keyframe's
// distance is a gauge freedom, which Levenberg-Marquardt damping holds.
BundleRequest WholeMapRequest(const Map& map);

}  // namespace planar_vslam
