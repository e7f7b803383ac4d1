// Maps as rviz markers.
#include "markers.h"

#include <gtest/gtest.h>

namespace planar_vslam::ros_face {
namespace {

using visualization_msgs::Marker;

TEST(Markers, CubesAreListedByTheirSize) {
  const std::vector<OccupiedCube> cubes{
      {{0.025F, 0.0F, 0.0F}, 0.05F}, {{1.0F, 0.0F, 2.0F}, 0.2F}, {{0.075F, 0, 0}, 0.05F}};
  const visualization_msgs::MarkerArray array = ToOctomapMarkers(std_msgs::Header(), 0.05, cubes);
  ASSERT_EQ(array.markers.size(), 16U);
  EXPECT_EQ(array.markers[0].points.size(), 2U);
  EXPECT_EQ(array.markers[0].colors.size(), 2U);
  EXPECT_NEAR(array.markers[0].scale.x, 0.05, 1e-9);
  EXPECT_EQ(array.markers[2].points.size(), 1U);
  EXPECT_NEAR(array.markers[2].scale.z, 0.2, 1e-9);
  for (const Marker& marker : array.markers) {
    EXPECT_EQ(marker.action, marker.points.empty() ? int{Marker::DELETE} : int{Marker::ADD});
    EXPECT_EQ(marker.pose.orientation.w, 1.0);
  }
}

TEST(Markers, GraphHasKeyframesLinksAndLoops) {
  Map map;
  for (std::uint32_t i = 0; i < 3; ++i) {
    Keyframe keyframe;
    keyframe.T_map_base.translation.x() = i;
    if (i > 0) keyframe.odometry_link = MotionLink{KeyframeId{i - 1}, {}};
    map.keyframes.Insert(KeyframeId{i}, std::move(keyframe));
  }
  const KeyframeId culled{99};
  const auto array = ToGraphMarkers(std_msgs::Header(), map, {{KeyframeId{0}, KeyframeId{2}}, {culled, KeyframeId{2}}});
  ASSERT_EQ(array.markers.size(), 4U);
  EXPECT_EQ(array.markers[0].points.size(), 3U);
  EXPECT_EQ(array.markers[1].points.size(), 4U) << "two links of the wheels";
  EXPECT_EQ(array.markers[2].action, int{Marker::DELETE}) << "no laser";
  ASSERT_EQ(array.markers[3].points.size(), 2U) << "the loop whose keyframes are there";
  EXPECT_EQ(array.markers[3].points[1].x, 2.0);
}

}  // namespace
}  // namespace planar_vslam::ros_face
