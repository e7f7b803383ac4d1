#include "planar_vslam/pipeline/map_planes.h"

#include <gtest/gtest.h>

namespace planar_vslam {
namespace {

// Landmarks on a floor 4 m by 4 m, at `height`, seen by three keyframes each.
Map MapWithFloor(double height) {
  Map map;
  map.metric = true;
  for (std::uint32_t i = 0; i < 400; ++i) {
    Landmark landmark;
    landmark.p_map = {0.2 * (i % 20), 0.2 * (i / 20), height + 0.002 * (i % 7)};  // NOLINT(bugprone-integer-division)
    landmark.observations.resize(3);
    map.landmarks.Insert(LandmarkId{i}, landmark);
  }
  return map;
}

TEST(MapPlanes, FloorOfTheLandmarksIsReported) {
  const MapPlanes planes = PlanesOf(MapWithFloor(0.06), PlaneOptions{});
  ASSERT_TRUE(planes.floor.has_value());
  EXPECT_NEAR(planes.floor->height, 0.066, 0.005);
  EXPECT_LT(planes.floor->TiltDegrees(), 0.5);
  EXPECT_NE(FloorText(planes.floor).find("+0.06"), std::string::npos);
  EXPECT_TRUE(planes.walls.empty());
}

TEST(MapPlanes, WithoutFloorOrScaleItSaysSo) {
  EXPECT_EQ(FloorText(PlanesOf(MapWithFloor(1.5), PlaneOptions{}).floor), "no floor seen");
  Map map = MapWithFloor(0.0);
  map.metric = false;
  EXPECT_FALSE(PlanesOf(map, PlaneOptions{}).floor.has_value());
}

}  // namespace
}  // namespace planar_vslam
