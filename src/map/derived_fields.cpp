#include "derived_fields.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "planar_vslam/feature/hamming.h"
#include "planar_vslam/geometry/check.h"

namespace planar_vslam {
namespace {

// Twice the median (the two middle values added when the count is even), so that it stays an integer.
int TwiceMedian(std::vector<int>* values) {
  const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  const int lower = values->size() % 2 == 1 ? *middle : *std::max_element(values->begin(), middle);
  return lower + *middle;
}

const Observation& ReferenceObservation(const Landmark& landmark) {
  for (const Observation& o : landmark.observations) {
    if (o.keyframe == landmark.created_by) return o;
  }
  return landmark.observations.front();
}

}  // namespace

Descriptor MedoidDescriptor(const std::vector<Descriptor>& descriptors) {
  const std::size_t n = descriptors.size();
  PV_CHECK(n > 0, "a landmark without observations has no descriptor");
  if (n <= 2) return descriptors.front();
  std::size_t best = 0;
  int best_median = std::numeric_limits<int>::max();
  std::vector<int> others(n - 1), distances;
  std::iota(others.begin(), others.end(), 1);  // all but the first; then all but the next
  for (std::size_t i = 0; i < n; ++i) {
    HammingDistances(descriptors[i], descriptors, others, &distances);
    const int median = TwiceMedian(&distances);
    if (median < best_median) {
      best = i;
      best_median = median;
    }
    if (i < others.size()) others[i] = static_cast<int>(i);
  }
  return descriptors[best];
}

void DerivedFields::UpdateDescriptor(Landmark* landmark) {
  descriptors_.clear();
  for (const Observation& o : landmark->observations) {
    descriptors_.push_back(map_.keyframes.At(o.keyframe).features->descriptors[o.keypoint]);
  }
  landmark->descriptor = MedoidDescriptor(descriptors_);
}

void DerivedFields::UpdateGeometry(Landmark* landmark) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Observation& o : landmark->observations) {
    sum += (landmark->p_map - CameraCenter(o.keyframe)).normalized();
  }
  landmark->view_direction = sum.normalized();  // zero where the directions cancel

  const Observation& reference = ReferenceObservation(*landmark);
  const Keyframe& keyframe = map_.keyframes.At(reference.keyframe);
  const auto octave = static_cast<std::size_t>(keyframe.features->keypoints[reference.keypoint].octave);
  PV_CHECK(octave < map_.octave_scales.size(), "keyframe " << reference.keyframe.value << " keypoint "
                                                           << reference.keypoint << " octave=" << octave
                                                           << " octave_scales.size()=" << map_.octave_scales.size());
  const double distance = (landmark->p_map - CameraCenter(reference.keyframe)).norm();
  landmark->max_distance = distance * map_.octave_scales[octave];
  landmark->min_distance = landmark->max_distance / map_.octave_scales.back();
}

Eigen::Vector3d DerivedFields::CameraCenter(KeyframeId id) const {
  const Keyframe& keyframe = map_.keyframes.At(id);
  return keyframe.T_map_base * keyframe.T_base_camera.translation;
}

}  // namespace planar_vslam
