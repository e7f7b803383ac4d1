#include "planar_vslam/geometry/two_view.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "planar_vslam/geometry/check.h"
#include "planar_vslam/geometry/chi_square.h"
#include "planar_vslam/geometry/median.h"
#include "planar_vslam/geometry/triangulation.h"
#include "two_view_models.h"
#include "two_view_motions.h"

namespace planar_vslam {

namespace {

// A model with fewer inliers than this, or this share of the matches, is what chance finds among wrong matches.
constexpr std::size_t kMinInliers = 2 * kTwoViewSample;
constexpr double kMinInlierShare = 0.25;
// A second motion with this share of the best one's points explains the views about equally well.
constexpr double kAmbiguousShare = 0.7;
// Motions closer than this in rotation and in direction are one motion (double roots of the decompositions).
constexpr double kSameMotion = DegreesToRadians(2.0);
// A depth counts when the rays differ by this many standard deviations of their angle.
constexpr double kDepthSigmas = 3.0;

struct Views {
  const std::vector<Eigen::Vector2d>& first;
  const std::vector<Eigen::Vector2d>& second;
  Eigen::Matrix3d K;
  double pixel_sigma;

  Eigen::Vector3d Ray(const Eigen::Vector2d& pixel) const {
    return {(pixel.x() - K(0, 2)) / K(0, 0), (pixel.y() - K(1, 2)) / K(1, 1), 1.0};
  }
  double NormalizedError(const Eigen::Vector3d& point, const Eigen::Vector2d& pixel) const {
    return ((K * point).hnormalized() - pixel).squaredNorm() / (pixel_sigma * pixel_sigma);
  }
  // Smallest angle between two rays (rad) that tells a depth.
  double DepthParallax() const { return kDepthSigmas * std::sqrt(2.0) * pixel_sigma / std::min(K(0, 0), K(1, 1)); }
};

double AngleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

struct MotionSupport {
  Rigid3 T_second_first;
  std::vector<std::optional<Eigen::Vector3d>> points;  // per match, in the first camera's frame
  std::vector<double> parallaxes;                      // rad, of the set points
  std::size_t at_infinity = 0;                         // matches this rotation explains without a depth
};

MotionSupport CountSupport(const Views& views, const std::vector<std::size_t>& inliers, const Rigid3& T_second_first) {
  MotionSupport support;
  support.T_second_first = T_second_first;
  support.points.resize(views.first.size());
  const Rigid3 T_first_second = T_second_first.Inverse();
  const double depth_parallax = views.DepthParallax();
  for (const std::size_t i : inliers) {
    const Eigen::Vector3d ray_first = views.Ray(views.first[i]);
    const Eigen::Vector3d ray_second = views.Ray(views.second[i]);
    if (AngleBetween(ray_first, T_first_second.rotation * ray_second) < depth_parallax) {
      ++support.at_infinity;
      continue;
    }
    const std::optional<Eigen::Vector3d> point = TriangulateTwoRays(ray_first, ray_second, T_first_second);
    if (!point) continue;
    const Eigen::Vector3d in_second = T_second_first * *point;
    if (point->z() <= 0.0 || in_second.z() <= 0.0) continue;
    if (!(views.NormalizedError(*point, views.first[i]) < kChi2TwoDof95)) continue;
    if (!(views.NormalizedError(in_second, views.second[i]) < kChi2TwoDof95)) continue;
    support.points[i] = point;
    support.parallaxes.push_back(ParallaxAngle(*point, Eigen::Vector3d::Zero(), T_first_second.translation));
  }
  return support;
}

bool SameMotion(const Rigid3& a, const Rigid3& b) {
  return a.rotation.angularDistance(b.rotation) < kSameMotion &&
         AngleBetween(a.translation, b.translation) < kSameMotion;
}

bool EnoughInliers(const ModelFit& model, std::size_t matches) {
  const double share = kMinInlierShare * static_cast<double>(matches);
  return model.inliers.size() >= kMinInliers && static_cast<double>(model.inliers.size()) >= share;
}

// The motion with most points decides; the others say whether it stands alone.
TwoViewStatus Judge(const std::vector<MotionSupport>& supports, const MotionSupport& best, double parallax_degrees,
                    std::size_t inliers, const TwoViewOptions& options) {
  const std::size_t points = best.parallaxes.size();
  if (points < static_cast<std::size_t>(std::max(0, options.min_points))) {
    const bool rotation_explains = std::any_of(
        supports.begin(), supports.end(), [inliers](const MotionSupport& s) { return 2 * s.at_infinity >= inliers; });
    return rotation_explains ? TwoViewStatus::kLowParallax : TwoViewStatus::kTooFewPoints;
  }
  if (parallax_degrees < options.min_parallax) return TwoViewStatus::kLowParallax;
  for (const MotionSupport& other : supports) {
    const bool as_good = static_cast<double>(other.parallaxes.size()) >= kAmbiguousShare * static_cast<double>(points);
    if (as_good && !SameMotion(best.T_second_first, other.T_second_first)) return TwoViewStatus::kAmbiguous;
  }
  return TwoViewStatus::kOk;
}

}  // namespace

TwoViewResult EstimateTwoViewMotion(const std::vector<Eigen::Vector2d>& first,
                                    const std::vector<Eigen::Vector2d>& second, double fx, double fy, double cx,
                                    double cy, const TwoViewOptions& options, std::uint32_t seed) {
  PV_CHECK(first.size() == second.size(), first.size() << " first and " << second.size() << " second pixels");
  TwoViewResult result;
  result.points.resize(first.size());
  if (first.size() < kTwoViewSample) return result;
  Eigen::Matrix3d K;
  K << fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0;
  const Views views{first, second, K, options.pixel_sigma};

  const TwoViewModels models = FitTwoViewModels(first, second, options.ransac_iterations, options.pixel_sigma, seed);
  const double both = models.homography.score + models.fundamental.score;
  result.used_homography = models.homography.score > options.homography_ratio * both;  // R_H
  const ModelFit& model = result.used_homography ? models.homography : models.fundamental;
  result.status = TwoViewStatus::kNoModel;
  if (!EnoughInliers(model, first.size())) return result;

  const std::vector<Rigid3> motions = result.used_homography ? MotionsFromHomography(K.inverse() * model.matrix * K)
                                                             : MotionsFromEssential(K.transpose() * model.matrix * K);
  result.status = TwoViewStatus::kLowParallax;
  if (motions.empty()) return result;
  std::vector<MotionSupport> supports;
  for (const Rigid3& motion : motions) supports.push_back(CountSupport(views, model.inliers, motion));
  const auto best = std::max_element(supports.begin(), supports.end(), [](const auto& a, const auto& b) {
    return a.parallaxes.size() < b.parallaxes.size();
  });

  result.parallax_degrees = RadiansToDegrees(Median(best->parallaxes));
  result.status = Judge(supports, *best, result.parallax_degrees, model.inliers.size(), options);
  if (result.status != TwoViewStatus::kOk) return result;
  result.T_first_second = best->T_second_first.Inverse();
  result.points = best->points;
  return result;
}

}  // namespace planar_vslam
