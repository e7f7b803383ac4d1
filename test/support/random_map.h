#pragma once
// Random maps and random edits of them, for property tests.
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "planar_vslam/map/map_edit.h"

namespace planar_vslam::test {

inline KeyframeId K(std::uint32_t value) { return KeyframeId{value}; }
inline LandmarkId L(std::uint32_t value) { return LandmarkId{value}; }

// Uniform in [0, count).
std::uint32_t RandomIndex(std::mt19937& generator, std::size_t count);

std::vector<double> OctaveScales();  // 8 levels of 1.2
FrameFeaturesPtr RandomFeatures(std::mt19937& generator, std::size_t keypoints);
// At a random pose, observing nothing.
LaserSweep RandomSweep(std::mt19937& generator);
Keyframe RandomKeyframe(std::mt19937& generator, std::size_t keypoints);
PlanarMotion RandomOdometry(std::mt19937& generator);

// Landmark at a random place, observed at keypoint `keypoint` of each of `keyframes`, created by the last.
Landmark LandmarkSeenBy(std::mt19937& generator, const std::vector<KeyframeId>& keyframes, std::uint32_t keypoint);

// `keyframes` keyframes chained by odometry with `landmarks` keypoints each; landmark k is keypoint k of every keyframe
// of a run of at least two.
Map RandomMap(std::mt19937& generator, std::size_t keyframes, std::size_t landmarks);

// Writes legal edits of one map, of every kind of step, some of which name ids that are gone.
class RandomEditor {
 public:
  RandomEditor(std::mt19937& generator, const Map& map);
  MapEdit Write(int steps);

 private:
  MapEditStep RandomStep();
  MapEditStep NewKeyframe();
  MapEditStep NewLandmark();
  KeyframeId AnyKeyframe();  // perhaps gone
  LandmarkId AnyLandmark();  // perhaps gone
  std::vector<LandmarkId> AnyLandmarks(std::size_t count);

  static constexpr std::size_t kKeypoints = 12;  // of a new keyframe
  std::mt19937& generator_;
  std::uint32_t next_keyframe_, next_landmark_;
  std::vector<std::pair<KeyframeId, std::uint32_t>> alive_;  // keyframes that exist and their number of keypoints
  std::set<std::pair<KeyframeId, std::uint32_t>> taken_;     // keypoints that may be taken when a step is carried out
};

// Exact equality of everything in two maps.
bool Equal(const Map& a, const Map& b);

}  // namespace planar_vslam::test
