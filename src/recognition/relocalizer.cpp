#include "planar_vslam/recognition/relocalizer.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "planar_vslam/feature/matching.h"
#include "planar_vslam/recognition/place_limits.h"

namespace planar_vslam {
namespace {

// Frame keypoint against a landmark of the keyframe, as PnP wants them.
struct Correspondences {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  std::vector<int> keypoints;
  std::vector<LandmarkId> landmarks;
};

Correspondences MatchToKeyframe(const Map& map, const Keyframe& keyframe, const FrameFeatures& features) {
  std::vector<int> with_landmark, all(features.keypoints.size());
  for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    if (keyframe.landmarks[i].valid()) with_landmark.push_back(static_cast<int>(i));
  }
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<int>(i);
  MatchOptions options;
  options.ratio = PlaceLimits::kPnpRatio;
  Correspondences c;
  for (const FeatureMatch& m : MatchBruteForce(*keyframe.features, with_landmark, features, all, options)) {
    const LandmarkId id = keyframe.landmarks[static_cast<std::size_t>(m.first)];
    const Eigen::Vector3d& p = map.landmarks.At(id).p_map;
    const Eigen::Vector2f& u = features.keypoints[static_cast<std::size_t>(m.second)].pixel;
    c.points.emplace_back(p.x(), p.y(), p.z());
    c.pixels.emplace_back(u.x(), u.y());
    c.keypoints.push_back(m.second);
    c.landmarks.push_back(id);
  }
  return c;
}

}  // namespace

std::optional<RelocalizationHypothesis> RelocalizeAgainst(const Map& map, KeyframeId keyframe,
                                                          const FrameFeatures& features, const CameraModel& camera) {
  const Correspondences c = MatchToKeyframe(map, map.keyframes.At(keyframe), features);
  if (static_cast<int>(c.points.size()) < PlaceLimits::kPnpMatches) return std::nullopt;
  const cv::Mat K = (cv::Mat_<double>(3, 3) << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  cv::Mat rotation_vector, translation;
  std::vector<int> inliers;
  // OpenCV seeds the generator of each call itself, so equal input gives equal output.
  const bool found = cv::solvePnPRansac(c.points, c.pixels, K, cv::noArray(), rotation_vector, translation, false,
                                        PlaceLimits::kPnpIterations, static_cast<float>(PlaceLimits::kPnpError),
                                        PlaceLimits::kPnpConfidence, inliers, cv::SOLVEPNP_EPNP);
  if (!found || static_cast<int>(inliers.size()) < PlaceLimits::kMinInliers) return std::nullopt;
  const Eigen::Vector3d phi(rotation_vector.at<double>(0), rotation_vector.at<double>(1),
                            rotation_vector.at<double>(2));
  const Eigen::Vector3d t(translation.at<double>(0), translation.at<double>(1), translation.at<double>(2));
  RelocalizationHypothesis hypothesis;
  hypothesis.T_map_camera = Rigid3(ExpSo3(phi), t).Inverse();
  hypothesis.matches.landmarks.resize(features.keypoints.size());
  for (const int i : inliers) {
    const auto k = static_cast<std::size_t>(i);
    hypothesis.matches.landmarks[static_cast<std::size_t>(c.keypoints[k])] = c.landmarks[k];
    ++hypothesis.matches.count;
  }
  return hypothesis;
}

}  // namespace planar_vslam
