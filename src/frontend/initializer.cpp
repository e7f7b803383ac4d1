#include "planar_vslam/frontend/initializer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "planar_vslam/feature/matching.h"
#include "planar_vslam/frontend/motion_agreement.h"
#include "planar_vslam/geometry/chi_square.h"
#include "planar_vslam/geometry/median.h"
#include "planar_vslam/geometry/triangulation.h"
#include "planar_vslam/map/map_edit.h"

namespace planar_vslam {
namespace {

// Where the first frame's keypoints would be in the second if all were infinitely far: the rotation alone.
std::vector<Eigen::Vector2f> RotationCompensated(const FrameFeatures& features, const CameraModel& camera,
                                                 const Eigen::Matrix3d& R_second_first) {
  std::vector<Eigen::Vector2f> predicted;
  predicted.reserve(features.keypoints.size());
  for (const Keypoint& keypoint : features.keypoints) {
    const Eigen::Vector3d ray = R_second_first * camera.Ray(keypoint.pixel.cast<double>());
    constexpr float kOutside = -1e6F;
    predicted.push_back(ray.z() > 0.0 ? camera.ProjectUndistorted(ray).cast<float>().eval()
                                      : Eigen::Vector2f(kOutside, kOutside));
  }
  return predicted;
}

double SquaredPixelError(const CameraModel& camera, const Eigen::Vector3d& p_camera, const Keypoint& keypoint,
                         double sigma) {
  return (camera.ProjectUndistorted(p_camera) - keypoint.pixel.cast<double>()).squaredNorm() / (sigma * sigma);
}

}  // namespace

// How exact a depth is follows from the parallax over the noise of a ray. The options' parallaxes are those of a camera
// of 610 px with a noise of 1 px: one of half as many pixels needs twice the angle.
Initializer::Initializer(const InitializerOptions& options, const MeasurementModel& bundle,
                         const std::vector<double>& octave_scales)
    : options_(options), bundle_(bundle), octave_scales_(octave_scales) {
  constexpr double kFocalLength = 610.0;  // px
  const double noise = bundle.pixel_sigma * kFocalLength / bundle.camera.fx;
  options_.min_parallax *= noise;
  options_.min_median_parallax *= noise;
}

InitializerReport Initializer::Restart(const InitializerInput& input, std::string reason) {
  first_.reset();
  if (static_cast<int>(input.features->keypoints.size()) >= options_.min_features) {
    first_ = First{input.stamp, input.features, input.T_base_camera, {}, input.moment};
  }
  return {std::nullopt, std::move(reason)};
}

InitializerReport Initializer::Add(const InitializerInput& input) {
  if (!first_.has_value()) return Restart(input, "a first image with enough texture");
  if (input.odometry.has_value()) first_->odometry = Compose(first_->odometry, *input.odometry);
  if (static_cast<int>(input.features->keypoints.size()) < options_.min_features) {
    return Restart(input, "an image with enough texture");
  }
  if (SecondsBetween(first_->stamp, input.stamp) > options_.max_baseline_time) {
    return Restart(input, "movement across the view, sideways if possible");
  }
  const bool has_odometry = first_->odometry.seconds > 0.0;
  if ((has_odometry || options_.mode == InitializationMode::kOdometry) &&
      CameraMotionByOdometry(input).translation.norm() < options_.min_baseline) {
    return {std::nullopt, "translation: the camera has moved less than the shortest usable baseline"};
  }
  return options_.mode == InitializationMode::kOdometry ? TryOdometry(input) : TryVisual(input);
}

Rigid3 Initializer::CameraMotionByOdometry(const InitializerInput& input) const {
  return first_->T_base_camera.Inverse() * Embed3(first_->odometry.T_i_j) * input.T_base_camera;
}

InitializerReport Initializer::TryOdometry(const InitializerInput& input) {
  const Rigid3 T_c1_c2 = CameraMotionByOdometry(input);
  const Eigen::Matrix3d R_c2_c1 = T_c1_c2.R().transpose();
  MatchOptions match_options;
  const std::vector<FeatureMatch> matches = MatchWithinRadius(
      *first_->features, *input.features, RotationCompensated(*first_->features, bundle_.camera, R_c2_c1),
      static_cast<float>(options_.search_radius), 1, match_options);
  if (static_cast<int>(matches.size()) < options_.min_matches) {
    return Restart(input, "enough features in common between two images");
  }
  std::vector<std::pair<int, int>> pairs;
  std::vector<std::optional<Eigen::Vector3d>> points;
  std::vector<double> parallaxes;
  for (const FeatureMatch& m : matches) {
    const Keypoint& k1 = first_->features->keypoints[static_cast<std::size_t>(m.first)];
    const Keypoint& k2 = input.features->keypoints[static_cast<std::size_t>(m.second)];
    const Eigen::Vector3d ray1 = bundle_.camera.Ray(k1.pixel.cast<double>());
    const Eigen::Vector3d ray2 = bundle_.camera.Ray(k2.pixel.cast<double>());
    const double cosine = ray1.normalized().dot((T_c1_c2.rotation * ray2).normalized());
    parallaxes.push_back(std::acos(std::clamp(cosine, -1.0, 1.0)));
    pairs.emplace_back(m.first, m.second);
    points.push_back(parallaxes.back() >= options_.min_parallax ? TriangulateTwoRays(ray1, ray2, T_c1_c2)
                                                                : std::nullopt);
  }
  if (Median(parallaxes) < options_.min_median_parallax) {
    return {std::nullopt, "parallax: drive on, sideways if possible"};
  }
  return Finish(input, T_c1_c2, pairs, points, true);
}

InitializerReport Initializer::TryVisual(const InitializerInput& input) {
  std::vector<Eigen::Vector2f> predicted;
  predicted.reserve(first_->features->keypoints.size());
  for (const Keypoint& k : first_->features->keypoints) predicted.push_back(k.pixel);
  MatchOptions match_options;
  const std::vector<FeatureMatch> matches =
      MatchWithinRadius(*first_->features, *input.features, predicted,
                        static_cast<float>(options_.visual_search_radius), 1, match_options);
  if (static_cast<int>(matches.size()) < options_.min_matches) {
    return Restart(input, "enough features in common between two images");
  }
  std::vector<Eigen::Vector2d> pixels1, pixels2;
  std::vector<std::pair<int, int>> pairs;
  for (const FeatureMatch& m : matches) {
    pixels1.emplace_back(first_->features->keypoints[static_cast<std::size_t>(m.first)].pixel.cast<double>());
    pixels2.emplace_back(input.features->keypoints[static_cast<std::size_t>(m.second)].pixel.cast<double>());
    pairs.emplace_back(m.first, m.second);
  }
  TwoViewOptions two_view;
  two_view.pixel_sigma = bundle_.pixel_sigma;
  two_view.min_points = options_.min_points;
  two_view.min_parallax = RadiansToDegrees(options_.min_median_parallax);
  const CameraModel& c = bundle_.camera;
  constexpr std::uint32_t kSeed = 1;
  TwoViewResult motion = EstimateTwoViewMotion(pixels1, pixels2, c.fx, c.fy, c.cx, c.cy, two_view, kSeed);
  if (motion.status != TwoViewStatus::kOk)
    return {std::nullopt, "a clear motion between two images, sideways if possible"};
  std::vector<double> depths;
  for (const auto& p : motion.points) {
    if (p.has_value()) depths.push_back(p->z());
  }
  const double scale = 1.0 / Median(depths);
  motion.T_first_second.translation *= scale;
  for (auto& p : motion.points) {
    if (p.has_value()) *p *= scale;
  }
  return Finish(input, motion.T_first_second, pairs, motion.points, false);
}

InitializerReport Initializer::Finish(const InitializerInput& input, const Rigid3& T_c1_c2,
                                      const std::vector<std::pair<int, int>>& matches,
                                      const std::vector<std::optional<Eigen::Vector3d>>& points, bool metric) {
  Map map;
  map.octave_scales = octave_scales_;
  map.metric = metric;
  const KeyframeId id1{0}, id2{1};
  Keyframe k1{first_->stamp, Rigid3(), first_->T_base_camera, first_->features, {}, {}};
  k1.moment = first_->moment;
  k1.landmarks.resize(first_->features->keypoints.size());
  Keyframe k2{
      input.stamp, k1.T_base_camera * T_c1_c2 * input.T_base_camera.Inverse(), input.T_base_camera, input.features, {},
      {}};
  k2.moment = input.moment;
  k2.landmarks.resize(input.features->keypoints.size());
  if (first_->odometry.seconds > 0.0)
    k2.odometry_link = MotionLink{id1, OverWholeMotion(first_->odometry, bundle_.odometry_noise)};
  MapEdit edit{AddKeyframe{id1, k1}, AddKeyframe{id2, k2}};
  const Rigid3 T_c2_c1 = T_c1_c2.Inverse();
  std::uint32_t next = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!points[i].has_value()) continue;
    const auto i1 = static_cast<std::size_t>(matches[i].first), i2 = static_cast<std::size_t>(matches[i].second);
    const Keypoint &kp1 = first_->features->keypoints[i1], &kp2 = input.features->keypoints[i2];
    const double s1 = bundle_.pixel_sigma * octave_scales_[static_cast<std::size_t>(kp1.octave)];
    const double s2 = bundle_.pixel_sigma * octave_scales_[static_cast<std::size_t>(kp2.octave)];
    const Eigen::Vector3d p_c2 = T_c2_c1 * *points[i];
    // Odometry is coarser than a pixel, so the gate before bundle adjustment is generous.
    constexpr double kGateSlack = 4.0;
    if (p_c2.z() <= 0.0 || points[i]->z() <= 0.0 ||
        SquaredPixelError(bundle_.camera, *points[i], kp1, s1) > kGateSlack * kChi2TwoDof95 ||
        SquaredPixelError(bundle_.camera, p_c2, kp2, s2) > kGateSlack * kChi2TwoDof95) {
      continue;
    }
    Landmark landmark;
    landmark.p_map = k1.T_map_camera() * *points[i];
    landmark.observations = {{id1, static_cast<std::uint32_t>(i1)}, {id2, static_cast<std::uint32_t>(i2)}};
    landmark.created_by = id2;
    edit.push_back(AddLandmark{LandmarkId{next++}, landmark});
  }
  if (static_cast<int>(next) < options_.min_points) {
    return {std::nullopt, "more points that fit the motion"};
  }
  map = Apply(std::move(map), edit);
  MeasurementModel context = bundle_;
  context.options.max_iterations = 20;
  const BundleResult bundle = AdjustBundle(map, WholeMapRequest(map), context, BundleSolver::kSchur);
  if (!bundle.converged) return Restart(input, "a first map that converges");
  map = Apply(std::move(map), ToEdit(bundle));
  if (static_cast<int>(map.landmarks.size()) < options_.min_points) {
    return {std::nullopt, "more points that survive bundle adjustment"};
  }
  if (!metric && first_->odometry.seconds > 0.0 && SquaredMotionDisagreement(map, context) > kChi2FiveDof999) {
    return {std::nullopt, "a motion on which images and odometry agree: drive on, sideways if possible"};
  }
  first_.reset();
  return {std::move(map), ""};
}

}  // namespace planar_vslam
