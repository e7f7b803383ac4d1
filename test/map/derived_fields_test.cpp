// Derived fields of landmarks against their definitions in map.h.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/random_map.h"

namespace planar_vslam::test {
namespace {

// A map of `descriptors.size()` keyframes on the x axis, one keypoint each, all of one landmark at (0, 0, 10).
Map MapOfOneLandmark(const std::vector<Descriptor>& descriptors, const std::vector<int>& octaves, KeyframeId creator) {
  Map map;
  map.octave_scales = {1.0, 2.0, 4.0};
  Landmark landmark;
  landmark.p_map = {0, 0, 10};
  landmark.created_by = creator;
  MapEdit edit;
  for (std::uint32_t i = 0; i < descriptors.size(); ++i) {
    auto features = std::make_shared<FrameFeatures>();
    features->keypoints.resize(1);
    features->keypoints[0].octave = octaves[i];
    features->descriptors = {descriptors[i]};
    Keyframe keyframe;
    keyframe.T_map_base.translation = Eigen::Vector3d(i, 0, 1);
    keyframe.T_base_camera.translation = Eigen::Vector3d(0, 0, -1);
    keyframe.features = features;
    keyframe.landmarks.resize(1);
    landmark.observations.push_back({K(i), 0});
    edit.push_back(AddKeyframe{K(i), keyframe});
  }
  edit.push_back(AddLandmark{L(0), landmark});
  return Apply(std::move(map), edit);
}

const Landmark& Only(const Map& map) { return map.landmarks.At(L(0)); }

TEST(DerivedFields, DescriptorIsTheOneInTheMiddle) {
  const std::vector<Descriptor> line = {{0b1111}, {0b0011}, {0b0000}};
  EXPECT_EQ(Only(MapOfOneLandmark(line, {0, 0, 0}, K(0))).descriptor, line[1]);
}

TEST(DerivedFields, AnOutlierDescriptorIsNotChosen) {
  const std::vector<Descriptor> seen = {{~0ULL, ~0ULL, 0, 0}, {0b01}, {0b00}, {0b10}};
  EXPECT_EQ(Only(MapOfOneLandmark(seen, {0, 0, 0, 0}, K(0))).descriptor, seen[2]);
}

TEST(DerivedFields, TiesGoToTheEarliestObservation) {
  const std::vector<Descriptor> seen = {{0b01}, {0b10}};
  EXPECT_EQ(Only(MapOfOneLandmark(seen, {0, 0}, K(0))).descriptor, seen[0]);
}

TEST(DerivedFields, DistancesComeFromTheCreatorsObservation) {
  const Map map = MapOfOneLandmark({{0}, {0}, {0}}, {2, 1, 0}, K(1));
  const double distance = std::hypot(1.0, 10.0);
  EXPECT_DOUBLE_EQ(Only(map).max_distance, distance * 2.0);
  EXPECT_DOUBLE_EQ(Only(map).min_distance, distance * 2.0 / 4.0);
}

TEST(DerivedFields, DistancesComeFromTheFirstObservationOnceTheCreatorIsGone) {
  const Map map = Apply(MapOfOneLandmark({{0}, {0}, {0}}, {2, 1, 0}, K(1)), {EraseKeyframe{K(1)}});
  EXPECT_EQ(Only(map).created_by, K(1));
  EXPECT_DOUBLE_EQ(Only(map).max_distance, 10.0 * 4.0);
}

TEST(DerivedFields, ViewDirectionIsTheMeanDirection) {
  const Map map = MapOfOneLandmark({{0}, {0}}, {0, 0}, K(0));
  const Eigen::Vector3d expected = (Eigen::Vector3d(0, 0, 1) + Eigen::Vector3d(-1, 0, 10).normalized()).normalized();
  EXPECT_NEAR((Only(map).view_direction - expected).norm(), 0.0, 1e-12);
}

TEST(DerivedFields, FollowAPointThatMoves) {
  const Map map = Apply(MapOfOneLandmark({{0}, {0}}, {0, 0}, K(0)), {SetLandmarkPosition{L(0), {0, 0, 20}}});
  EXPECT_DOUBLE_EQ(Only(map).max_distance, 20.0);
}

TEST(DerivedFields, FollowACameraThatMoves) {
  Rigid3 T_map_base;
  T_map_base.translation = {0, 0, 6};  // the camera is 1 below the base
  const Map map = Apply(MapOfOneLandmark({{0}, {0}}, {0, 0}, K(0)), {SetKeyframePose{K(0), T_map_base}});
  EXPECT_DOUBLE_EQ(Only(map).max_distance, 5.0);
}

TEST(DerivedFields, StayFiniteForAPointInTheCamera) {
  const Map map = Apply(MapOfOneLandmark({{0}, {0}}, {0, 0}, K(0)), {SetLandmarkPosition{L(0), {0, 0, 0}}});
  EXPECT_EQ(Validate(map), std::vector<std::string>());
}

// The median of the distances to the others, by its definition.
double MedianDistance(const std::vector<Descriptor>& descriptors, std::size_t i) {
  std::vector<int> distances;
  for (std::size_t j = 0; j < descriptors.size(); ++j) {
    if (j != i) distances.push_back(HammingDistance(descriptors[i], descriptors[j]));
  }
  std::sort(distances.begin(), distances.end());
  const std::size_t n = distances.size();
  return 0.5 * (distances[(n - 1) / 2] + distances[n / 2]);
}

TEST(DerivedFields, DescriptorHasTheLeastMedianDistance) {
  std::mt19937 generator(5);
  for (std::size_t count = 2; count < 12; ++count) {
    std::vector<Descriptor> seen;
    for (std::size_t i = 0; i < count; ++i) seen.push_back({generator() % 256, generator() % 256, 0, 0});
    std::size_t best = 0;
    for (std::size_t i = 1; i < count; ++i) {
      if (MedianDistance(seen, i) < MedianDistance(seen, best)) best = i;
    }
    EXPECT_EQ(Only(MapOfOneLandmark(seen, std::vector<int>(count, 0), K(0))).descriptor, seen[best]) << count;
  }
}

}  // namespace
}  // namespace planar_vslam::test
