#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <sstream>

#include "planar_vslam/map/map.h"

namespace planar_vslam {
namespace {

constexpr double kUnitTolerance = 1e-6;  // of a quaternion's norm; products are renormalised to about 1e-16

// Collects one line per broken invariant.
class Problems {
 public:
  template <class... Parts>
  void Add(const Parts&... parts) {
    std::ostringstream line;
    (line << ... << parts);
    lines_.push_back(line.str());
  }
  template <class... Parts>
  void Unless(bool sound, const Parts&... parts) {
    if (!sound) Add(parts...);
  }
  std::vector<std::string> Take() { return std::move(lines_); }

 private:
  std::vector<std::string> lines_;
};

bool IsRigid(const Rigid3& T) {
  return T.translation.allFinite() && T.rotation.coeffs().allFinite() &&
         std::abs(T.rotation.norm() - 1.0) < kUnitTolerance;
}

template <class IdType, class Value>
void CheckIds(const IdMap<IdType, Value>& entries, std::uint32_t next_id, const char* kind, Problems* problems) {
  for (const auto& [id, value] : entries) {
    problems->Unless(id.valid() && id.value < next_id, kind, " ", id.value, ": id not below the counter ", next_id);
  }
}

void CheckOctaveScales(const Map& map, Problems* problems) {
  double previous = 0.0;
  for (std::size_t level = 0; level < map.octave_scales.size(); ++level) {
    const double scale = map.octave_scales[level];
    problems->Unless(std::isfinite(scale) && scale > previous, "octave_scales[", level, "] = ", scale,
                     ": expected finite, positive and ascending");
    previous = scale;
  }
}

void CheckFeatures(const Map& map, KeyframeId id, const FrameFeatures& features, Problems* problems) {
  problems->Unless(features.descriptors.size() == features.keypoints.size(), "keyframe ", id.value, ": ",
                   features.descriptors.size(), " descriptors for ", features.keypoints.size(), " keypoints");
  for (std::size_t k = 0; k < features.keypoints.size(); ++k) {
    const Keypoint& keypoint = features.keypoints[k];
    problems->Unless(keypoint.octave >= 0 && static_cast<std::size_t>(keypoint.octave) < map.octave_scales.size(),
                     "keyframe ", id.value, " keypoint ", k, ": octave ", keypoint.octave, " of ",
                     map.octave_scales.size());
    problems->Unless(keypoint.pixel.allFinite(), "keyframe ", id.value, " keypoint ", k, ": pixel not finite");
  }
}

void CheckLink(const Map& map, KeyframeId id, const char* kind, const MotionLink& link, Problems* problems) {
  problems->Unless(map.keyframes.Contains(link.from), "keyframe ", id.value, ": ", kind, " link from keyframe ",
                   link.from.value, " that does not exist");
  problems->Unless(link.from < id, "keyframe ", id.value, ": ", kind, " link from keyframe ", link.from.value,
                   " that is not earlier");
  const PlanarMotion& o = link.motion;
  const bool finite = o.T_i_j.translation.allFinite() && std::isfinite(o.T_i_j.angle) && o.covariance.allFinite() &&
                      std::isfinite(o.distance) && std::isfinite(o.turn) && std::isfinite(o.seconds);
  problems->Unless(finite, "keyframe ", id.value, ": ", kind, " link not finite");
}

void CheckLinks(const Map& map, KeyframeId id, const Keyframe& keyframe, Problems* problems) {
  if (keyframe.odometry_link) CheckLink(map, id, "odometry", *keyframe.odometry_link, problems);
  KeyframeId previous;
  for (const MotionLink& link : keyframe.laser_links) {
    CheckLink(map, id, "laser", link, problems);
    const bool definite = Eigen::LLT<Eigen::Matrix3d>(link.motion.covariance).info() == Eigen::Success;
    problems->Unless(definite, "keyframe ", id.value, ": laser link from keyframe ", link.from.value,
                     ": covariance not positive definite");
    problems->Unless(!previous.valid() || previous < link.from, "keyframe ", id.value, ": laser link from keyframe ",
                     link.from.value, " not after keyframe ", previous.value);
    previous = link.from;
  }
}

// The direction keyframe -> landmark of every reference.
void CheckLandmarksOf(const Map& map, KeyframeId id, const Keyframe& keyframe, Problems* problems) {
  for (std::size_t k = 0; k < keyframe.landmarks.size(); ++k) {
    const LandmarkId landmark_id = keyframe.landmarks[k];
    if (!landmark_id.valid()) continue;
    const Landmark* landmark = map.landmarks.Find(landmark_id);
    if (landmark == nullptr) {
      problems->Add("keyframe ", id.value, " keypoint ", k, ": landmark ", landmark_id.value, " does not exist");
      continue;
    }
    const auto& observations = landmark->observations;
    const bool listed = std::any_of(observations.begin(), observations.end(),
                                    [&](const Observation& o) { return o.keyframe == id && o.keypoint == k; });
    problems->Unless(listed, "keyframe ", id.value, " keypoint ", k, ": landmark ", landmark_id.value,
                     " does not list this observation");
  }
}

void CheckSweeps(KeyframeId id, const std::vector<LaserSweep>& sweeps, Problems* problems) {
  for (std::size_t i = 0; i < sweeps.size(); ++i) {
    const LaserSweep& sweep = sweeps[i];
    if (sweep.scan == nullptr) {
      problems->Add("keyframe ", id.value, " sweep ", i, ": no scan");
      continue;
    }
    const bool finite = IsRigid(sweep.T_base_laser) && sweep.T_keyframe_base.translation.allFinite() &&
                        std::isfinite(sweep.T_keyframe_base.angle);
    problems->Unless(finite, "keyframe ", id.value, " sweep ", i, ": poses not finite rigid motions");
    const PlanarScan& scan = *sweep.scan;
    const bool sound = std::isfinite(scan.angle_min) && std::isfinite(scan.angle_increment) &&
                       std::isfinite(scan.range_min) && std::isfinite(scan.range_max);
    problems->Unless(sound, "keyframe ", id.value, " sweep ", i, ": angles or range limits not finite");
  }
}

void CheckKeyframe(const Map& map, KeyframeId id, const Keyframe& keyframe, Problems* problems) {
  problems->Unless(IsRigid(keyframe.T_map_base), "keyframe ", id.value, ": T_map_base not a finite rigid motion");
  problems->Unless(IsRigid(keyframe.T_base_camera), "keyframe ", id.value, ": T_base_camera not a finite rigid motion");
  if (keyframe.features == nullptr) {
    problems->Add("keyframe ", id.value, ": no features");
  } else {
    CheckFeatures(map, id, *keyframe.features, problems);
    problems->Unless(keyframe.landmarks.size() == keyframe.features->keypoints.size(), "keyframe ", id.value, ": ",
                     keyframe.landmarks.size(), " landmark entries for ", keyframe.features->keypoints.size(),
                     " keypoints");
  }
  CheckLandmarksOf(map, id, keyframe, problems);
  CheckSweeps(id, keyframe.sweeps, problems);
  CheckLinks(map, id, keyframe, problems);
}

// The direction landmark -> keyframe of every reference.
void CheckObservationsOf(const Map& map, LandmarkId id, const Landmark& landmark, Problems* problems) {
  problems->Unless(!landmark.observations.empty(), "landmark ", id.value, ": no observations");
  KeyframeId previous;
  for (const Observation& o : landmark.observations) {
    problems->Unless(!previous.valid() || previous < o.keyframe, "landmark ", id.value, ": observation in keyframe ",
                     o.keyframe.value, " not after keyframe ", previous.value);
    previous = o.keyframe;
    const Keyframe* keyframe = map.keyframes.Find(o.keyframe);
    if (keyframe == nullptr) {
      problems->Add("landmark ", id.value, ": observing keyframe ", o.keyframe.value, " does not exist");
    } else if (o.keypoint >= keyframe->landmarks.size()) {
      problems->Add("landmark ", id.value, ": keypoint ", o.keypoint, " beyond the ", keyframe->landmarks.size(),
                    " of keyframe ", o.keyframe.value);
    } else {
      problems->Unless(keyframe->landmarks[o.keypoint] == id, "landmark ", id.value, ": keyframe ", o.keyframe.value,
                       " keypoint ", o.keypoint, " does not refer to it");
    }
  }
}

void CheckLandmark(const Map& map, LandmarkId id, const Landmark& landmark, Problems* problems) {
  CheckObservationsOf(map, id, landmark, problems);
  problems->Unless(landmark.created_by.value < map.next_keyframe_id, "landmark ", id.value, ": created by keyframe ",
                   landmark.created_by.value, " that never was");
  problems->Unless(landmark.p_map.allFinite(), "landmark ", id.value, ": position not finite");
  problems->Unless(landmark.view_direction.allFinite(), "landmark ", id.value, ": view direction not finite");
  const double min = landmark.min_distance, max = landmark.max_distance;
  problems->Unless(std::isfinite(min) && std::isfinite(max) && 0.0 <= min && min <= max, "landmark ", id.value,
                   ": distance range [", min, ", ", max, "]");
}

void CheckIndexes(const Map& map, Problems* problems) {
  Map rebuilt = map;
  RebuildIndexes(&rebuilt);
  problems->Unless(map.bases == rebuilt.bases && map.cameras == rebuilt.cameras,
                   "places of keyframes: not where they are indexed");
  for (const auto& [id, keyframe] : map.keyframes) {
    problems->Unless(keyframe.linked_by == rebuilt.keyframes.At(id).linked_by, "keyframe ", id.value,
                     ": not all links from it are indexed, or others");
  }
}

}  // namespace

std::vector<std::string> Validate(const Map& map) {
  Problems problems;
  CheckIds(map.keyframes, map.next_keyframe_id, "keyframe", &problems);
  CheckIds(map.landmarks, map.next_landmark_id, "landmark", &problems);
  CheckOctaveScales(map, &problems);
  for (const auto& [id, keyframe] : map.keyframes) CheckKeyframe(map, id, keyframe, &problems);
  for (const auto& [id, landmark] : map.landmarks) CheckLandmark(map, id, landmark, &problems);
  CheckIndexes(map, &problems);
  return problems.Take();
}

}  // namespace planar_vslam
