#include <algorithm>

#include "planar_vslam/feature/hamming.h"
#include "planar_vslam/geometry/chi_square.h"
#include "planar_vslam/map/predicted_view.h"
#include "planar_vslam/map/queries.h"
#include "stages.h"

namespace planar_vslam {
namespace {

// Memory of FindKeypoint, kept from one landmark to the next.
struct Scratch {
  std::vector<int> indices, distances;
};

// The keypoint of `target` that shows the landmark, or -1.
int FindKeypoint(const Map& map, const Landmark& landmark, const PredictedView& view, const FrameFeatures& features,
                 const MapperContext& context, Scratch* scratch) {
  auto& [indices, distances] = *scratch;
  const double scale = map.octave_scales[static_cast<std::size_t>(view.octave)];
  const int last_octave = static_cast<int>(map.octave_scales.size()) - 1;
  indices.clear();
  features.grid.Search(features.keypoints, view.pixel, static_cast<float>(context.options.fusion_radius * scale),
                       std::max(0, view.octave - 1), std::min(last_octave, view.octave + 1), &indices);
  const auto is_off = [&](int index) {
    const Keypoint& keypoint = features.keypoints[static_cast<std::size_t>(index)];
    const double sigma = context.model.pixel_sigma * map.octave_scales[static_cast<std::size_t>(keypoint.octave)];
    return (keypoint.pixel - view.pixel).cast<double>().squaredNorm() > kChi2TwoDof95 * sigma * sigma;
  };
  indices.erase(std::remove_if(indices.begin(), indices.end(), is_off), indices.end());
  HammingDistances(landmark.descriptor, features.descriptors, indices, &distances);
  const auto best = std::min_element(distances.begin(), distances.end());
  if (best == distances.end() || *best > context.options.max_descriptor_distance) return -1;
  return indices[static_cast<std::size_t>(best - distances.begin())];
}

bool SeenBy(const Landmark& landmark, KeyframeId keyframe) {
  return std::any_of(landmark.observations.begin(), landmark.observations.end(),
                     [keyframe](const Observation& o) { return o.keyframe == keyframe; });
}

}  // namespace

MapEdit FuseInto(const Map& map, const std::vector<LandmarkId>& landmarks, KeyframeId target,
                 const MapperContext& context) {
  const Keyframe& keyframe = map.keyframes.At(target);
  const Rigid3 T_map_camera = keyframe.T_map_camera();
  MapEdit edit;
  Scratch scratch;
  std::vector<LandmarkId> merged;  // a landmark takes part in one merge an edit
  for (const LandmarkId id : landmarks) {
    const Landmark* landmark = map.landmarks.Find(id);
    PredictedView view;
    if (landmark == nullptr || SeenBy(*landmark, target)) continue;
    if (!PredictView(*landmark, T_map_camera, context.model.camera, map.octave_scales, &view)) continue;
    const int keypoint = FindKeypoint(map, *landmark, view, *keyframe.features, context, &scratch);
    if (keypoint < 0) continue;
    const LandmarkId holder = keyframe.landmarks[static_cast<std::size_t>(keypoint)];
    if (!holder.valid()) {
      edit.emplace_back(AddObservation{id, {target, static_cast<std::uint32_t>(keypoint)}});
      continue;
    }
    if (std::find(merged.begin(), merged.end(), id) != merged.end() ||
        std::find(merged.begin(), merged.end(), holder) != merged.end()) {
      continue;
    }
    const bool keep_holder = map.landmarks.At(holder).observations.size() >= landmark->observations.size();
    edit.emplace_back(keep_holder ? MergeLandmarks{id, holder} : MergeLandmarks{holder, id});
    merged.push_back(id);
    merged.push_back(holder);
  }
  return edit;
}

MapEdit FuseWithNeighbors(Map* map, KeyframeId id, const MapperContext& context) {
  const MapperOptions& o = context.options;
  const std::vector<KeyframeId> neighbors =
      WithNearby(*map, id, Neighbors(*map, id, o.fusion_neighbors, 1, o.min_shared), o);
  MapEdit done;
  const auto take = [map, &done](const MapEdit& edit) {
    *map = Apply(std::move(*map), edit);
    done.insert(done.end(), edit.begin(), edit.end());
  };
  for (const KeyframeId neighbor : neighbors) {
    take(FuseInto(*map, ValidOnly(map->keyframes.At(id).landmarks), neighbor, context));
  }
  take(FuseInto(*map, LandmarksOf(*map, neighbors), id, context));
  return done;
}

}  // namespace planar_vslam
