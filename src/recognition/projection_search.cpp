#include "planar_vslam/recognition/projection_search.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "planar_vslam/geometry/median.h"

namespace planar_vslam {
namespace {

constexpr double kFrontalCos = 0.998;          // within 3.6 degrees the projected patch barely changes
constexpr double kFrontalRadiusShare = 0.625;  // so the window may be smaller

struct BestTwo {
  int best = 257, second = 257;
  int best_octave = -1, second_octave = -1;
  int index = -1;
};

BestTwo FindBestTwo(const Landmark& landmark, const FrameFeatures& features, const std::vector<int>& indices,
                    const std::vector<LandmarkId>& taken) {
  BestTwo two;
  for (const int index : indices) {
    const auto i = static_cast<std::size_t>(index);
    if (taken[i].valid()) continue;
    const int distance = HammingDistance(landmark.descriptor, features.descriptors[i]);
    const int octave = features.keypoints[i].octave;
    if (distance < two.best) {
      two.second = two.best;
      two.second_octave = two.best_octave;
      two.best = distance;
      two.best_octave = octave;
      two.index = index;
    } else if (distance < two.second) {
      two.second = distance;
      two.second_octave = octave;
    }
  }
  return two;
}

}  // namespace

void SearchByProjection(const Map& map, const std::vector<LandmarkId>& candidates, const Rigid3& T_map_camera,
                        const CameraModel& camera, const FrameFeatures& features,
                        const ProjectionSearchOptions& options, FrameMatches* matches) {
  matches->landmarks.resize(features.keypoints.size());
  std::vector<LandmarkId> already;
  for (const LandmarkId id : matches->landmarks) {
    if (id.valid()) already.push_back(id);
  }
  std::sort(already.begin(), already.end());
  std::vector<int> indices;
  const auto last_octave = static_cast<int>(map.octave_scales.size()) - 1;
  for (const LandmarkId id : candidates) {
    const Landmark* landmark = map.landmarks.Find(id);
    PredictedView view;
    if (landmark == nullptr || !PredictView(*landmark, T_map_camera, camera, map.octave_scales, &view)) continue;
    if (std::binary_search(already.begin(), already.end(), id)) continue;
    matches->visible.push_back(id);
    const double narrow = view.cos_view_angle > kFrontalCos ? kFrontalRadiusShare : 1.0;
    const double radius = options.radius * narrow * map.octave_scales[static_cast<std::size_t>(view.octave)];
    indices.clear();
    features.grid.Search(features.keypoints, view.pixel, static_cast<float>(radius), std::max(0, view.octave - 1),
                         std::min(last_octave, view.octave + 1), &indices);
    const BestTwo two = FindBestTwo(*landmark, features, indices, matches->landmarks);
    if (two.index < 0 || two.best > options.max_distance) continue;
    if (two.best_octave == two.second_octave && two.best > options.ratio * two.second) continue;
    matches->landmarks[static_cast<std::size_t>(two.index)] = id;
    ++matches->count;
  }
}

std::vector<KeyframeId> VotedKeyframes(const Map& map, const std::vector<LandmarkId>& landmarks, std::size_t limit) {
  std::vector<int> votes(map.next_keyframe_id, 0);
  for (const LandmarkId id : landmarks) {
    const Landmark* landmark = map.landmarks.Find(id);
    if (landmark == nullptr) continue;
    for (const Observation& o : landmark->observations) ++votes[o.keyframe.value];
  }
  std::vector<KeyframeId> keyframes;
  for (std::uint32_t i = 0; i < votes.size(); ++i) {
    if (votes[i] > 0) keyframes.push_back(KeyframeId{i});
  }
  std::stable_sort(keyframes.begin(), keyframes.end(),
                   [&votes](KeyframeId a, KeyframeId b) { return votes[a.value] > votes[b.value]; });
  if (keyframes.size() > limit) keyframes.resize(limit);
  return keyframes;
}

std::vector<KeyframeId> NearbyKeyframes(const Map& map, const Rigid3& T_map_camera, double distance, double angle,
                                        std::size_t limit) {
  std::vector<std::pair<double, KeyframeId>> near;
  const Eigen::Vector3d axis = T_map_camera.rotation * Eigen::Vector3d::UnitZ();
  for (const auto& [id, keyframe] : map.keyframes) {
    const Rigid3 T = keyframe.T_map_camera();
    const double d = (T.translation - T_map_camera.translation).norm();
    if (d <= distance && axis.dot(T.rotation * Eigen::Vector3d::UnitZ()) >= std::cos(angle)) near.emplace_back(d, id);
  }
  std::sort(near.begin(), near.end());
  if (near.size() > limit) near.resize(limit);
  std::vector<KeyframeId> ids;
  ids.reserve(near.size());
  for (const auto& [d, id] : near) ids.push_back(id);
  return ids;
}

std::vector<LandmarkId> ValidOnly(const std::vector<LandmarkId>& ids) {
  std::vector<LandmarkId> valid;
  std::copy_if(ids.begin(), ids.end(), std::back_inserter(valid), [](LandmarkId id) { return id.valid(); });
  return valid;
}

int CountWellObserved(const Map& map, const std::vector<LandmarkId>& ids) {
  constexpr std::size_t kWellObserved = 2;
  return static_cast<int>(std::count_if(ids.begin(), ids.end(), [&map](LandmarkId id) {
    const Landmark* landmark = id.valid() ? map.landmarks.Find(id) : nullptr;
    return landmark != nullptr && landmark->observations.size() >= kWellObserved;
  }));
}

double MedianDepth(const Map& map, const std::vector<LandmarkId>& ids, const Rigid3& T_map_camera) {
  const Rigid3 T_camera_map = T_map_camera.Inverse();
  std::vector<double> depths;
  for (const LandmarkId id : ids) {
    const Landmark* landmark = id.valid() ? map.landmarks.Find(id) : nullptr;
    if (landmark != nullptr) depths.push_back((T_camera_map * landmark->p_map).z());
  }
  return Median(std::move(depths));
}

std::vector<LandmarkId> LandmarksOf(const Map& map, const std::vector<KeyframeId>& keyframes) {
  std::vector<LandmarkId> ids;
  for (const KeyframeId keyframe : keyframes) {
    for (const LandmarkId id : map.keyframes.At(keyframe).landmarks) {
      if (id.valid()) ids.push_back(id);
    }
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

}  // namespace planar_vslam
