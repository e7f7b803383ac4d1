#include "planar_vslam/recognition/projection_search.h"

#include <algorithm>

#include "planar_vslam/feature/hamming.h"

namespace planar_vslam {
namespace {

constexpr double kFrontalCos = 0.998;          // within 3.6 degrees the projected patch barely changes
constexpr double kFrontalRadiusShare = 0.625;  // so the window may be smaller

struct BestTwo {
  int best = 257, second = 257;
  int best_octave = -1, second_octave = -1;
  int index = -1;
};

// `distances` is scratch.
BestTwo FindBestTwo(const Landmark& landmark, const FrameFeatures& features, const std::vector<int>& indices,
                    std::vector<int>* distances) {
  HammingDistances(landmark.descriptor, features.descriptors, indices, distances);
  BestTwo two;
  for (std::size_t k = 0; k < indices.size(); ++k) {
    const int distance = (*distances)[k];
    const int octave = features.keypoints[static_cast<std::size_t>(indices[k])].octave;
    if (distance < two.best) {
      two.second = two.best;
      two.second_octave = two.best_octave;
      two.best = distance;
      two.best_octave = octave;
      two.index = indices[k];
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
  std::vector<int> indices, distances;
  const auto is_taken = [matches](int i) { return matches->landmarks[static_cast<std::size_t>(i)].valid(); };
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
    indices.erase(std::remove_if(indices.begin(), indices.end(), is_taken), indices.end());
    const BestTwo two = FindBestTwo(*landmark, features, indices, &distances);
    if (two.index < 0 || two.best > options.max_distance) continue;
    if (two.best_octave == two.second_octave && two.best > options.ratio * two.second) continue;
    matches->landmarks[static_cast<std::size_t>(two.index)] = id;
    ++matches->count;
  }
}

}  // namespace planar_vslam
