#include <algorithm>
#include <cmath>
#include <utility>

#include "planar_vslam/feature/hamming.h"
#include "planar_vslam/feature/line_search.h"
#include "planar_vslam/feature/matching.h"
#include "planar_vslam/geometry/chi_square.h"
#include "planar_vslam/geometry/median.h"
#include "planar_vslam/geometry/triangulation.h"
#include "planar_vslam/optimize/reprojection_factor.h"
#include "stages.h"

namespace planar_vslam {
namespace {

constexpr double kScaleSlack = 1.5;  // ratio of patch sizes, beside one pyramid level

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

// How far a keypoint of each octave may lie from the epipolar line of its twin, px^2.
std::vector<float> SquaredReaches(const View& view) {
  std::vector<float> reaches;
  reaches.reserve(view.sigmas.size());
  for (const double sigma : view.sigmas) reaches.push_back(static_cast<float>(kChi2OneDof95 * sigma * sigma));
  return reaches;
}

// The nearest of `candidates`, the smaller index on ties; none beyond `max_distance`. `distances` is scratch.
FeatureMatch NearestOf(const Descriptor& query, const std::vector<Descriptor>& descriptors,
                       const std::vector<int>& candidates, int max_distance, std::vector<int>* distances) {
  HammingDistances(query, descriptors, candidates, distances);
  FeatureMatch best{-1, -1, max_distance + 1};
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const int distance = (*distances)[k];
    if (distance < best.distance || (distance == best.distance && candidates[k] < best.second)) {
      best.second = candidates[k];
      best.distance = distance;
    }
  }
  return best;
}

// Best unmatched keypoint of `b` near the epipolar line of keypoint `i` of `a`; one-to-one by smaller distance.
std::vector<FeatureMatch> MatchAlongEpipolarLines(const View& a, const View& b, int max_distance) {
  const Eigen::Matrix3d F = FundamentalMatrix(a, b);
  const FrameFeatures& features = *b.keyframe.features;
  const LineSearch search(features.keypoints, b.unmatched, SquaredReaches(b));
  std::vector<FeatureMatch> best_of_b(features.keypoints.size());
  std::vector<int> candidates, distances;
  for (const int i : a.unmatched) {
    const Eigen::Vector2f& u = a.keypoint(i).pixel;
    const Eigen::Vector3f line = (F * Eigen::Vector3d(u.x(), u.y(), 1.0)).cast<float>();
    if (line.head<2>().squaredNorm() <= 0.0F) continue;
    candidates.clear();
    search.Find(line, &candidates);
    FeatureMatch best = NearestOf(a.descriptor(i), features.descriptors, candidates, max_distance, &distances);
    if (best.second < 0) continue;
    best.first = i;
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

// Whether the point that two rays, both in one frame, come closest to may have the parallax: about their angle.
bool MayHaveParallax(const Eigen::Vector3d& ray_a, const Eigen::Vector3d& ray_b, double min_parallax) {
  constexpr double kShare = 0.8;
  return ray_a.dot(ray_b) <= std::cos(kShare * min_parallax) * ray_a.norm() * ray_b.norm();
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

bool HasBaseline(const Map& map, const View& a, const View& b, double min_ratio) {
  const double baseline = (a.T_map_camera.translation - b.T_map_camera.translation).norm();
  return baseline > 0.0 && baseline >= min_ratio * MedianLandmarkDepth(map, b);
}

// The point that both keypoints show, in the map, if they can show one.
std::optional<Eigen::Vector3d> Triangulate(const View& a, const View& b, const Rigid3& T_a_b, const FeatureMatch& match,
                                           double min_parallax) {
  const Keypoint &ka = a.keypoint(match.first), &kb = b.keypoint(match.second);
  const Eigen::Vector3d ray_a = a.camera.Ray(ka.pixel.cast<double>()), ray_b = b.camera.Ray(kb.pixel.cast<double>());
  if (!MayHaveParallax(ray_a, T_a_b.rotation * ray_b, min_parallax)) return std::nullopt;
  const std::optional<Eigen::Vector3d> p_a = TriangulateTwoRays(ray_a, ray_b, T_a_b);
  if (!p_a.has_value()) return std::nullopt;
  const Eigen::Vector3d p_map = a.T_map_camera * *p_a;
  if (ParallaxAngle(p_map, a.T_map_camera.translation, b.T_map_camera.translation) < min_parallax) return std::nullopt;
  if (!a.Sees(p_map, ka) || !b.Sees(p_map, kb) || !ScaleAgrees(a, b, ka, kb, p_map)) return std::nullopt;
  return p_map;
}

}  // namespace

MapEdit TriangulateWith(const Map& map, KeyframeId newest, const std::vector<KeyframeId>& neighbors,
                        const MapperContext& context) {
  const MapperOptions& o = context.options;
  View a(map, map.keyframes.At(newest), context.model.camera, context.model.pixel_sigma);
  MapEdit edit;
  std::uint32_t next = map.next_landmark_id;
  std::vector<bool> taken(a.keyframe.landmarks.size(), false);
  for (const KeyframeId neighbor : neighbors) {
    const View b(map, map.keyframes.At(neighbor), context.model.camera, context.model.pixel_sigma);
    if (!HasBaseline(map, a, b, o.min_baseline_ratio)) continue;
    const Rigid3 T_a_b = a.T_camera_map * b.T_map_camera;
    for (const FeatureMatch& m : MatchAlongEpipolarLines(a, b, o.max_descriptor_distance)) {
      const std::optional<Eigen::Vector3d> p_map = Triangulate(a, b, T_a_b, m, o.min_parallax);
      if (!p_map.has_value()) continue;
      Landmark landmark;
      landmark.p_map = *p_map;
      landmark.observations = {{neighbor, static_cast<std::uint32_t>(m.second)},
                               {newest, static_cast<std::uint32_t>(m.first)}};
      std::sort(landmark.observations.begin(), landmark.observations.end(),
                [](const Observation& x, const Observation& y) { return x.keyframe < y.keyframe; });
      landmark.created_by = newest;
      edit.emplace_back(AddLandmark{LandmarkId{next++}, std::move(landmark)});
      taken[static_cast<std::size_t>(m.first)] = true;
    }
    const auto is_taken = [&taken](int i) { return taken[static_cast<std::size_t>(i)]; };
    a.unmatched.erase(std::remove_if(a.unmatched.begin(), a.unmatched.end(), is_taken), a.unmatched.end());
  }
  return edit;
}

}  // namespace planar_vslam
