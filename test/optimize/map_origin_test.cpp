// What a map hangs on: x, y and yaw of its first keyframe, not the tilt its camera happened to have.
#include <gtest/gtest.h>

#include "planar_vslam/optimize/bundle_adjustment.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

class MapOrigin : public ::testing::TestWithParam<BundleSolver> {};
INSTANTIATE_TEST_SUITE_P(Solvers, MapOrigin, ::testing::Values(BundleSolver::kSchur, BundleSolver::kCeres));

// The true poses of a map whose first camera leaned by `tilt` when the map was made level with it.
Map LeaningMap(const test::SyntheticWorld& world, double tilt) {
  const Rigid3 lean(ExpSo3(Eigen::Vector3d(tilt, -tilt, 0.0)), Eigen::Vector3d::Zero());
  return Apply(world.map, {TransformMap{1.0, lean}});
}

TEST_P(MapOrigin, IsLevelAsTheFloorIsNotAsTheFirstCameraStood) {
  test::SyntheticWorldOptions options;
  options.keyframes = 12;
  const test::SyntheticWorld world = test::MakeSyntheticWorld(options);
  constexpr double kTilt = 0.01;
  Map map = LeaningMap(world, kTilt);
  MeasurementModel model = world.Context();
  model.options.max_iterations = 50;
  model.options.relative_gain = 1e-9;
  const Keyframe before = map.keyframes.begin()->second;
  map = Apply(std::move(map), ToEdit(AdjustBundle(map, WholeMapRequest(map), model, GetParam())));
  const Keyframe& first = map.keyframes.begin()->second;
  EXPECT_EQ(first.T_map_base.translation.head<2>(), before.T_map_base.translation.head<2>());
  for (const auto& [id, keyframe] : map.keyframes) {
    EXPECT_GT(keyframe.T_map_base.R()(2, 2), std::cos(0.1 * kTilt)) << id.value;
    EXPECT_NEAR(keyframe.T_map_base.translation.z(), 0.0, 0.002) << id.value;
  }
}

// As long as a ramp is not known to be one, all on it ask for the map to be level there.
TEST_P(MapOrigin, IsNotTippedByARamp) {
  test::SyntheticWorldOptions options;
  options.keyframes = 12;
  const test::SyntheticWorld world = test::MakeSyntheticWorld(options);
  Map map = LeaningMap(world, DegreesToRadians(4.0));
  Keyframe& first = map.keyframes.Edit(map.keyframes.begin()->first);  // it alone stands before the ramp
  const Rigid3 T_map_camera = first.T_map_camera();
  first.T_map_base = Embed3(ProjectToPlane(first.T_map_base));
  first.T_base_camera = first.T_map_base.Inverse() * T_map_camera;
  const Rigid3 before = first.T_map_base;
  MeasurementModel model = world.Context();
  model.options.max_iterations = 50;
  map = Apply(std::move(map), ToEdit(AdjustBundle(map, WholeMapRequest(map), model, GetParam())));
  const Rigid3& after = map.keyframes.begin()->second.T_map_base;
  EXPECT_EQ(after.translation, before.translation);
  EXPECT_EQ(after.rotation.coeffs(), before.rotation.coeffs());
}

TEST_P(MapOrigin, StaysAsItIsWhereNothingIsKnownOfAFloor) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  for (const bool off_floor : {false, true}) {
    Map map = test::Perturbed(world, 0.02, 0.01, 0.05, 4);
    MeasurementModel model = world.Context();
    if (off_floor) {
      map.keyframes.Edit(map.keyframes.begin()->first).on_floor = false;
    } else {
      model.planar.mode = PlanarMode::kOff;
    }
    const BundleResult result = AdjustBundle(map, WholeMapRequest(map), model, GetParam());
    ASSERT_TRUE(result.converged);
    EXPECT_EQ(result.poses.size() + 1, map.keyframes.size());
    EXPECT_FALSE(result.poses.front().first == map.keyframes.begin()->first);
  }
}

}  // namespace
}  // namespace planar_vslam
