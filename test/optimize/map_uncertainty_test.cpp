#include "planar_vslam/optimize/map_uncertainty.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

constexpr SystematicErrors kNone{1e-9, 1e-9};

Eigen::Matrix3d KeyframeCovariance(const Map& map, KeyframeId id, const BundleContext& context,
                                   const SystematicErrors& systematic) {
  return MapUncertainty(map, TiesOf(map, context), systematic).CovarianceOf(id);
}

// Only motion links tie the keyframes: no landmarks.
Map Chain(int keyframes, const OdometryNoise& noise) {
  Map map;
  map.metric = true;
  map.octave_scales = {1.0};
  for (int k = 0; k < keyframes; ++k) {
    Keyframe keyframe;
    keyframe.stamp = Timestamp::FromSeconds(k);
    keyframe.T_map_base = Embed3(Rigid2(0.5 * k, 0.0, 0.0));
    keyframe.features = std::make_shared<const FrameFeatures>();
    if (k > 0) {
      PreintegratedOdometry step;
      step.T_i_j = Rigid2(0.5, 0.0, 0.0);
      step.covariance = IncrementCovariance(noise, step.T_i_j);
      keyframe.odometry_link = OdometryLink{KeyframeId{static_cast<std::uint32_t>(k - 1)}, step};
    }
    map = Apply(std::move(map), {AddKeyframe{KeyframeId{static_cast<std::uint32_t>(k)}, std::move(keyframe)}});
  }
  return map;
}

BundleContext Context() {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  return world.Context();
}

TEST(KeyframeCovariance, IsNoneForTheOrigin) {
  const BundleContext context = Context();
  EXPECT_TRUE(KeyframeCovariance(Chain(3, context.odometry_noise), KeyframeId{0}, context, kNone).isZero());
}

TEST(KeyframeCovariance, OfAChainIsThatOfItsComposedOdometry) {
  const BundleContext context = Context();
  const Map map = Chain(9, context.odometry_noise);
  PreintegratedOdometry sum;
  for (const auto& [id, keyframe] : map.keyframes) {
    if (!keyframe.odometry_link.has_value()) continue;
    PreintegratedOdometry step = keyframe.odometry_link->odometry;
    step.covariance = CovarianceWithFloor(step, context.odometry_noise);
    sum = Compose(sum, step);
    const Eigen::Matrix3d expected = sum.covariance;  // the way is straight: both ends have the same axes
    const Eigen::Matrix3d covariance = KeyframeCovariance(map, id, context, kNone);
    EXPECT_LT((covariance - expected).norm(), 1e-3 * expected.norm()) << id.value;
  }
}

TEST(KeyframeCovariance, GrowsWithTheWayWhereWheelsReadWrongThroughout) {
  const BundleContext context = Context();
  const Map map = Chain(9, context.odometry_noise);
  for (const auto& [id, keyframe] : map.keyframes) {
    const double along = KeyframeCovariance(map, id, context, {0.02, 1e-9})(0, 0) -
                         (id.value == 0 ? 0.0 : KeyframeCovariance(map, id, context, kNone)(0, 0));
    const double expected = 0.02 * keyframe.T_map_base.translation.x();
    EXPECT_NEAR(along, expected * expected, 1e-3 * expected * expected) << id.value;
  }
}

TEST(KeyframeCovariance, FallsWithATieToAnOldPlace) {
  const BundleContext context = Context();
  Map map = Chain(9, context.odometry_noise);
  const double before = KeyframeCovariance(map, KeyframeId{8}, context, kNone).trace();
  PreintegratedOdometry closing;
  closing.T_i_j = Rigid2(4.0, 0.0, 0.0);
  closing.covariance = 1e-6 * Eigen::Matrix3d::Identity();
  map = Apply(std::move(map), {AddLaserLinks{KeyframeId{8}, {OdometryLink{KeyframeId{0}, closing}}}});
  EXPECT_LT(KeyframeCovariance(map, KeyframeId{8}, context, kNone).trace(), 0.1 * before);
}

TEST(KeyframeCovariance, IsPositiveDefiniteAndLandmarksOnlyLowerIt) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  const BundleContext context = world.Context();
  const KeyframeId last = std::prev(world.map.keyframes.end())->first;
  const Eigen::Matrix3d with = KeyframeCovariance(world.map, last, context, kNone);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(with);
  EXPECT_GT(eigen.eigenvalues().minCoeff(), 0.0);
  Map without = world.map;
  EraseLandmarks all;
  for (const auto& [id, landmark] : without.landmarks) all.ids.push_back(id);
  without = Apply(std::move(without), {all});
  EXPECT_LT(with.trace(), KeyframeCovariance(without, last, context, kNone).trace());
}

TEST(KeyframeCovariance, OfAKeyframeNothingTiesIsHuge) {
  const BundleContext context = Context();
  Map map = Chain(2, context.odometry_noise);
  Keyframe alone;
  alone.stamp = Timestamp::FromSeconds(10);
  alone.features = std::make_shared<const FrameFeatures>();
  map = Apply(std::move(map), {AddKeyframe{KeyframeId{2}, alone}});
  EXPECT_GT(KeyframeCovariance(map, KeyframeId{2}, context, kNone).diagonal().minCoeff(), 1e3);
}

}  // namespace
}  // namespace planar_vslam
