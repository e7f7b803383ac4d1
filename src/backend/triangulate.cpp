#include <algorithm>
#include <cmath>
#include <utility>

#include "planar_vslam/feature/matching.h"
#include "planar_vslam/geometry/median.h"
#include "planar_vslam/geometry/triangulation.h"
#include "planar_vslam/optimize/reprojection_factor.h"
#include "stages.h"

namespace planar_vslam {
namespace {

constexpr double kChi2OneDof95 = 3.841;  // chi-square, 1 dof, 95 %
constexpr double kChi2TwoDof95 = 5.991;  // chi-square, 2 dof, 95 %
constexpr double kScaleSlack = 1.5;      // ratio of patch sizes, beside one pyramid level

// One of the two views, with what triangulation asks of it.
struct View {
  View(const Map& map, const Keyframe& k, const CameraModel& c, double pixel_sigma)
      : keyframe(k), camera(c), T_map_camera(k.T_map_camera()), T_camera_map(T_map_camera.Inverse()) {
    for (std::size_t i = 0; i < k.landmarks.size(); ++i) {
      if (!k.landmarks[i].valid()) unmatched.push_back(static_cast<int>(i));
    }
    for (const double s : map.octave_scales) sigmas.push_back(pixel_sigma * s);
  }
  const Keypoint& keypoint(int i) const { return keyframe.features->keypoints[static_cast<std::size_t>(i)]; }
  const Descriptor& descriptor(int i) const { return keyframe.features->descriptors[static_cast<std::size_t>(i)]; }
  double sigma(const Keypoint& k) const { return sigmas[static_cast<std::size_t>(k.octave)]; }
  bool Sees(const Eigen::Vector3d& p_map, const Keypoint& k) const {
    const Eigen::Vector3d p = T_camera_map * p_map;
    if (p.z() <= kMinDepth) return false;
    return ((camera.ProjectUndistorted(p) - k.pixel.cast<double>()) / sigma(k)).squaredNorm() <= kChi2TwoDof95;
  }

  const Keyframe& keyframe;
  const CameraModel& camera;
  Rigid3 T_map_camera, T_camera_map;
  std::vector<int> unmatched;
  std::vector<double> sigmas;  // px per octave
};

double MedianLandmarkDepth(const Map& map, const View& view) {
  std::vector<double> depths;
  for (const LandmarkId id : view.keyframe.landmarks) {
    if (id.valid()) depths.push_back((view.T_camera_map * map.landmarks.At(id).p_map).z());
  }
  return Median(std::move(depths));
}

// F with x_b^T F x_a = 0 for pixels.
Eigen::Matrix3d FundamentalMatrix(const View& a, const View& b) {
  const Rigid3 T_b_a = b.T_camera_map * a.T_map_camera;
  Eigen::Matrix3d K_inverse = Eigen::Matrix3d::Identity();
  K_inverse(0, 0) = 1.0 / a.camera.fx;
  K_inverse(1, 1) = 1.0 / a.camera.fy;
  K_inverse(0, 2) = -a.camera.cx / a.camera.fx;
  K_inverse(1, 2) = -a.camera.cy / a.camera.fy;
  return K_inverse.transpose() * Skew(T_b_a.translation) * T_b_a.R() * K_inverse;
}

// A keypoint as the search along an epipolar line asks for it.
struct EpipolarCandidate {
  Eigen::Vector2f pixel;
  float squared_limit;  // px^2, of its distance from the line
  int keypoint;
};
std::vector<EpipolarCandidate> UnmatchedCandidates(const View& view) {
  std::vector<EpipolarCandidate> candidates;
  candidates.reserve(view.unmatched.size());
  for (const int j : view.unmatched) {
    const Keypoint& k = view.keypoint(j);
    const double sigma = view.sigma(k);
    candidates.push_back({k.pixel, static_cast<float>(kChi2OneDof95 * sigma * sigma), j});
  }
  return candidates;
}

// Best unmatched keypoint of `b` near the epipolar line of keypoint `i` of `a`; one-to-one by smaller distance.
std::vector<FeatureMatch> MatchAlongEpipolarLines(const View& a, const View& b, int max_distance) {
  const Eigen::Matrix3d F = FundamentalMatrix(a, b);
  const std::vector<EpipolarCandidate> candidates = UnmatchedCandidates(b);
  std::vector<FeatureMatch> best_of_b(b.keyframe.features->keypoints.size());
  for (const int i : a.unmatched) {
    const Eigen::Vector2f& u = a.keypoint(i).pixel;
    const Eigen::Vector3f line = (F * Eigen::Vector3d(u.x(), u.y(), 1.0)).cast<float>();
    const float norm = line.head<2>().squaredNorm();
    if (norm <= 0.0F) continue;
    FeatureMatch best{i, -1, max_distance + 1};
    for (const EpipolarCandidate& c : candidates) {
      const float distance = line.x() * c.pixel.x() + line.y() * c.pixel.y() + line.z();
      if (distance * distance > c.squared_limit * norm) continue;
      const int bits = HammingDistance(a.descriptor(i), b.descriptor(c.keypoint));
      if (bits < best.distance) best = {i, c.keypoint, bits};
    }
    if (best.second < 0) continue;
    FeatureMatch& holder = best_of_b[static_cast<std::size_t>(best.second)];
    if (holder.second < 0 || best.distance < holder.distance) holder = best;
  }
  std::vector<FeatureMatch> matches;
  for (const FeatureMatch& m : best_of_b) {
    if (m.second >= 0) matches.push_back(m);
  }
  KeepConsistentRotation(*a.keyframe.features, *b.keyframe.features, &matches);
  return matches;
}

bool ScaleAgrees(const View& a, const View& b, const Keypoint& ka, const Keypoint& kb, const Eigen::Vector3d& p_map) {
  const double distance_a = (p_map - a.T_map_camera.translation).norm();
  const double distance_b = (p_map - b.T_map_camera.translation).norm();
  if (distance_a <= 0.0 || distance_b <= 0.0) return false;
  // The same corner covers the same patch of the world from both: octave scale times distance agree.
  const double ratio = (distance_b * b.sigma(kb)) / (distance_a * a.sigma(ka));
  const double slack = kScaleSlack * (a.sigmas.size() > 1 ? a.sigmas[1] / a.sigmas[0] : 1.0);
  return ratio < slack && ratio > 1.0 / slack;
}

}  // namespace

MapEdit TriangulateWith(const Map& map, KeyframeId newest, KeyframeId neighbor, const MapperContext& context) {
  const MapperOptions& o = context.options;
  const View a(map, map.keyframes.At(newest), context.model.camera, context.model.pixel_sigma);
  const View b(map, map.keyframes.At(neighbor), context.model.camera, context.model.pixel_sigma);
  const double baseline = (a.T_map_camera.translation - b.T_map_camera.translation).norm();
  const double depth = MedianLandmarkDepth(map, b);
  if (baseline <= 0.0 || baseline < o.min_baseline_ratio * depth) return {};

  MapEdit edit;
  std::uint32_t next = map.next_landmark_id;
  const Rigid3 T_a_b = a.T_camera_map * b.T_map_camera;
  for (const FeatureMatch& m : MatchAlongEpipolarLines(a, b, o.max_descriptor_distance)) {
    const Keypoint &ka = a.keypoint(m.first), &kb = b.keypoint(m.second);
    const Eigen::Vector3d ray_a = a.camera.Ray(ka.pixel.cast<double>()), ray_b = b.camera.Ray(kb.pixel.cast<double>());
    const std::optional<Eigen::Vector3d> p_a = TriangulateTwoRays(ray_a, ray_b, T_a_b);
    if (!p_a.has_value()) continue;
    const Eigen::Vector3d p_map = a.T_map_camera * *p_a;
    if (ParallaxAngle(p_map, a.T_map_camera.translation, b.T_map_camera.translation) < o.min_parallax) continue;
    if (!a.Sees(p_map, ka) || !b.Sees(p_map, kb) || !ScaleAgrees(a, b, ka, kb, p_map)) continue;
    Landmark landmark;
    landmark.p_map = p_map;
    landmark.observations = {{neighbor, static_cast<std::uint32_t>(m.second)},
                             {newest, static_cast<std::uint32_t>(m.first)}};
    std::sort(landmark.observations.begin(), landmark.observations.end(),
              [](const Observation& x, const Observation& y) { return x.keyframe < y.keyframe; });
    landmark.created_by = newest;
    edit.emplace_back(AddLandmark{LandmarkId{next++}, landmark});
  }
  return edit;
}

}  // namespace planar_vslam
