#include "support/random_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "support/support.h"

namespace planar_vslam::test {

std::uint32_t RandomIndex(std::mt19937& generator, std::size_t count) {
  return static_cast<std::uint32_t>(generator() % count);
}

std::vector<double> OctaveScales() {
  std::vector<double> scales;
  for (int level = 0; level < 8; ++level) scales.push_back(std::pow(1.2, level));
  return scales;
}

FrameFeaturesPtr RandomFeatures(std::mt19937& generator, std::size_t keypoints) {
  auto features = std::make_shared<FrameFeatures>();
  features->keypoints.resize(keypoints);
  features->descriptors.resize(keypoints);
  for (Keypoint& keypoint : features->keypoints) {
    keypoint.octave = static_cast<std::int32_t>(RandomIndex(generator, OctaveScales().size()));
  }
  for (Descriptor& descriptor : features->descriptors) {
    // Few differing bits, so that ties of the median occur.
    descriptor = {generator() % 16, 0, generator() % 16, 0};
  }
  return features;
}

LaserSweep RandomSweep(std::mt19937& generator) {
  auto scan = std::make_shared<PlanarScan>();
  scan->stamp.nanoseconds = static_cast<std::int64_t>(generator());
  scan->angle_min = -1.0;
  scan->angle_increment = 0.5;
  scan->range_max = 8.0;
  for (int beam = 0; beam < 5; ++beam) {
    const bool no_return = generator() % 4 == 0;
    scan->ranges.push_back(no_return ? std::numeric_limits<float>::infinity()
                                     : std::uniform_real_distribution<float>(0.1F, 8.0F)(generator));
  }
  return {std::move(scan), RandomRigid3(generator, 0.5), RandomRigid2(generator, 0.3)};
}

Keyframe RandomKeyframe(std::mt19937& generator, std::size_t keypoints) {
  Keyframe keyframe;
  keyframe.T_map_base = RandomRigid3(generator, 3.0);
  keyframe.T_base_camera = RandomRigid3(generator, 0.5);
  keyframe.features = RandomFeatures(generator, keypoints);
  keyframe.landmarks.resize(keypoints);
  for (std::size_t i = generator() % 3; i > 0; --i) keyframe.sweeps.push_back(RandomSweep(generator));
  return keyframe;
}

PlanarMotion RandomOdometry(std::mt19937& generator) {
  PlanarMotion odometry;
  odometry.T_i_j = RandomRigid2(generator, 1.0);
  odometry.covariance.diagonal() << 1e-4, 2e-4, 3e-4;
  odometry.distance = odometry.T_i_j.translation.norm();
  odometry.turn = std::abs(odometry.T_i_j.angle);
  odometry.seconds = 0.5;
  return odometry;
}

Landmark LandmarkSeenBy(std::mt19937& generator, const std::vector<KeyframeId>& keyframes, std::uint32_t keypoint) {
  Landmark landmark;
  landmark.p_map = RandomRigid3(generator, 8.0).translation;
  for (const KeyframeId id : keyframes) landmark.observations.push_back({id, keypoint});
  landmark.created_by = keyframes.back();
  return landmark;
}

Map RandomMap(std::mt19937& generator, std::size_t keyframes, std::size_t landmarks) {
  Map map;
  map.octave_scales = OctaveScales();
  MapEdit edit;
  for (std::uint32_t i = 0; i < keyframes; ++i) {
    Keyframe keyframe = RandomKeyframe(generator, landmarks);
    if (i > 0) keyframe.odometry_link = MotionLink{K(i - 1), RandomOdometry(generator)};
    if (i > 1) keyframe.laser_links = {{K(i - 2), RandomOdometry(generator)}, {K(i - 1), RandomOdometry(generator)}};
    edit.push_back(AddKeyframe{K(i), keyframe});
  }
  for (std::uint32_t k = 0; k < landmarks; ++k) {
    const std::uint32_t first = RandomIndex(generator, keyframes - 1);
    const std::uint32_t last = first + 1 + RandomIndex(generator, keyframes - 1 - first);
    std::vector<KeyframeId> run;
    for (std::uint32_t i = first; i <= last; ++i) run.push_back(K(i));
    edit.push_back(AddLandmark{L(k), LandmarkSeenBy(generator, run, k)});
  }
  return Apply(std::move(map), edit);
}

RandomEditor::RandomEditor(std::mt19937& generator, const Map& map)
    : generator_(generator), next_keyframe_(map.next_keyframe_id), next_landmark_(map.next_landmark_id) {
  for (const auto& [id, keyframe] : map.keyframes) {
    alive_.emplace_back(id, static_cast<std::uint32_t>(keyframe.landmarks.size()));
    for (std::uint32_t k = 0; k < keyframe.landmarks.size(); ++k) {
      if (keyframe.landmarks[k].valid()) taken_.emplace(id, k);
    }
  }
}

MapEdit RandomEditor::Write(int steps) {
  MapEdit edit;
  for (int i = 0; i < steps; ++i) edit.push_back(RandomStep());
  return edit;
}

MapEditStep RandomEditor::RandomStep() {
  switch (RandomIndex(generator_, 18)) {
    case 0:
    case 1:
      return NewKeyframe();
    case 2:
    case 3:
      if (alive_.size() > 1) return NewLandmark();
      return NewKeyframe();
    case 4:
      return EraseObservation{AnyLandmark(), AnyKeyframe()};
    case 5:
      return EraseLandmarks{AnyLandmarks(2)};
    case 6: {
      const KeyframeId id = AnyKeyframe();
      alive_.erase(std::remove_if(alive_.begin(), alive_.end(), [id](const auto& e) { return e.first == id; }),
                   alive_.end());
      return EraseKeyframe{id};
    }
    case 7:
      return MergeLandmarks{AnyLandmark(), AnyLandmark()};
    case 8:
      return SetKeyframePose{AnyKeyframe(), RandomRigid3(generator_, 3.0)};
    case 9:
      return SetLandmarkPosition{AnyLandmark(), RandomRigid3(generator_, 8.0).translation};
    case 10:
      return CountSightings{AnyLandmarks(6), AnyLandmarks(3)};
    case 11:
      return TransformMap{0.5 + 0.1 * RandomIndex(generator_, 10), RandomRigid3(generator_, 2.0)};
    case 12:
      return SetMetric{generator_() % 2 == 0};
    case 13:
      return AddSweeps{AnyKeyframe(), {RandomSweep(generator_), RandomSweep(generator_)}};
    case 14:
      return AddLaserLinks{AnyKeyframe(),
                           {{AnyKeyframe(), RandomOdometry(generator_)}, {AnyKeyframe(), RandomOdometry(generator_)}}};
    case 15:
      return SetOffFloor{{AnyKeyframe(), AnyKeyframe()}};
    case 16:
      return SetImageOffset{0.01 * RandomIndex(generator_, 5)};
    default: {
      if (alive_.empty()) return SetMetric{};
      const auto [keyframe, keypoints] = alive_[RandomIndex(generator_, alive_.size())];
      const Observation observation{keyframe, RandomIndex(generator_, keypoints)};
      taken_.emplace(keyframe, observation.keypoint);
      return AddObservation{AnyLandmark(), observation};
    }
  }
}

MapEditStep RandomEditor::NewKeyframe() {
  AddKeyframe step{K(next_keyframe_++), RandomKeyframe(generator_, kKeypoints)};
  step.keyframe.moment.velocity = {0.1 * RandomIndex(generator_, 4), 0.0, 0.5 * RandomIndex(generator_, 4)};
  if (generator_() % 4 != 0 && step.id.value > 0) {
    step.keyframe.odometry_link = MotionLink{AnyKeyframe(), RandomOdometry(generator_)};
    if (!(step.keyframe.odometry_link->from < step.id)) step.keyframe.odometry_link.reset();
  }
  for (std::uint32_t k = 0; k < kKeypoints / 2; ++k) {  // the other half stays free for new landmarks
    step.keyframe.landmarks[k] = AnyLandmark();
    taken_.emplace(step.id, k);
  }
  alive_.emplace_back(step.id, static_cast<std::uint32_t>(kKeypoints));
  return step;
}

MapEditStep RandomEditor::NewLandmark() {
  Landmark landmark = LandmarkSeenBy(generator_, {AnyKeyframe()}, 0);
  landmark.observations.clear();
  for (const auto& [keyframe, keypoints] : alive_) {
    const std::uint32_t keypoint = RandomIndex(generator_, keypoints);
    if (landmark.observations.size() < 5 && taken_.emplace(keyframe, keypoint).second) {
      landmark.observations.push_back({keyframe, keypoint});
    }
  }
  if (landmark.observations.empty()) return NewKeyframe();
  if (generator_() % 2 == 0) landmark.created_by = landmark.observations.back().keyframe;
  return AddLandmark{L(next_landmark_++), landmark};
}

KeyframeId RandomEditor::AnyKeyframe() { return K(RandomIndex(generator_, std::max(1U, next_keyframe_))); }
LandmarkId RandomEditor::AnyLandmark() { return L(RandomIndex(generator_, next_landmark_ + 1)); }

std::vector<LandmarkId> RandomEditor::AnyLandmarks(std::size_t count) {
  std::vector<LandmarkId> ids;
  for (std::size_t i = 0; i < count; ++i) ids.push_back(AnyLandmark());
  return ids;
}

namespace {

bool Equal(const Rigid3& a, const Rigid3& b) {
  return a.translation == b.translation && a.rotation.coeffs() == b.rotation.coeffs();
}

bool Equal(const MotionLink& a, const MotionLink& b) {
  return a.from == b.from && a.motion.T_i_j.translation == b.motion.T_i_j.translation &&
         a.motion.T_i_j.angle == b.motion.T_i_j.angle && a.motion.covariance == b.motion.covariance &&
         a.motion.distance == b.motion.distance && a.motion.turn == b.motion.turn &&
         a.motion.seconds == b.motion.seconds;
}

bool Equal(const std::optional<MotionLink>& a, const std::optional<MotionLink>& b) {
  if (!a || !b) return a.has_value() == b.has_value();
  return Equal(*a, *b);
}

// Ranges are compared as bits: no return is infinite.
bool Equal(const LaserSweep& a, const LaserSweep& b) {
  const PlanarScan &x = *a.scan, &y = *b.scan;
  return x.stamp == y.stamp && x.angle_min == y.angle_min && x.angle_increment == y.angle_increment &&
         x.range_min == y.range_min && x.range_max == y.range_max && x.ranges == y.ranges &&
         Equal(a.T_base_laser, b.T_base_laser) && a.T_keyframe_base.translation == b.T_keyframe_base.translation &&
         a.T_keyframe_base.angle == b.T_keyframe_base.angle;
}

bool Equal(const Keyframe& a, const Keyframe& b) {
  const auto same = [](const auto& x, const auto& y) { return Equal(x, y); };
  return a.stamp == b.stamp && Equal(a.T_map_base, b.T_map_base) && Equal(a.T_base_camera, b.T_base_camera) &&
         a.features == b.features && a.landmarks == b.landmarks && Equal(a.odometry_link, b.odometry_link) &&
         std::equal(a.sweeps.begin(), a.sweeps.end(), b.sweeps.begin(), b.sweeps.end(), same) &&
         std::equal(a.laser_links.begin(), a.laser_links.end(), b.laser_links.begin(), b.laser_links.end(), same) &&
         a.linked_by == b.linked_by;
}

bool Equal(const Landmark& a, const Landmark& b) {
  const auto same = [](const Observation& x, const Observation& y) {
    return x.keyframe == y.keyframe && x.keypoint == y.keypoint;
  };
  return a.p_map == b.p_map && a.created_by == b.created_by && a.predicted_visible == b.predicted_visible &&
         a.found == b.found && a.descriptor == b.descriptor && a.view_direction == b.view_direction &&
         a.min_distance == b.min_distance && a.max_distance == b.max_distance &&
         std::equal(a.observations.begin(), a.observations.end(), b.observations.begin(), b.observations.end(), same);
}

template <class IdType, class Value>
bool Equal(const IdMap<IdType, Value>& a, const IdMap<IdType, Value>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const auto& x, const auto& y) { return x.first == y.first && Equal(x.second, y.second); });
}

}  // namespace

bool Equal(const Map& a, const Map& b) {
  return Equal(a.keyframes, b.keyframes) && Equal(a.landmarks, b.landmarks) &&
         a.next_keyframe_id == b.next_keyframe_id && a.next_landmark_id == b.next_landmark_id && a.metric == b.metric &&
         a.octave_scales == b.octave_scales && a.bases == b.bases && a.cameras == b.cameras;
}

}  // namespace planar_vslam::test
