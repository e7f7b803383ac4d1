#include "planar_vslam/optimize/map_uncertainty.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

constexpr SystematicErrors kNone{1e-9, 1e-9};

Eigen::Matrix3d KeyframeCovariance(const Map& map, KeyframeId id, const MeasurementModel& context,
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
      PlanarMotion step;
      step.T_i_j = Rigid2(0.5, 0.0, 0.0);
      step.covariance = IncrementCovariance(noise, step.T_i_j);
      keyframe.odometry_link = MotionLink{KeyframeId{static_cast<std::uint32_t>(k - 1)}, step};
    }
    map = Apply(std::move(map), {AddKeyframe{KeyframeId{static_cast<std::uint32_t>(k)}, std::move(keyframe)}});
  }
  return map;
}

MeasurementModel Context() {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  return world.Context();
}

TEST(KeyframeCovariance, IsNoneForTheOrigin) {
  const MeasurementModel context = Context();
  EXPECT_TRUE(KeyframeCovariance(Chain(3, context.odometry_noise), KeyframeId{0}, context, kNone).isZero());
}

TEST(KeyframeCovariance, OfAChainIsThatOfItsComposedOdometry) {
  const MeasurementModel context = Context();
  const Map map = Chain(9, context.odometry_noise);
  PlanarMotion sum;
  for (const auto& [id, keyframe] : map.keyframes) {
    if (!keyframe.odometry_link.has_value()) continue;
    PlanarMotion step = keyframe.odometry_link->motion;
    step.covariance = CovarianceWithFloor(step, context.odometry_noise);
    sum = Compose(sum, step);
    const Eigen::Matrix3d expected = sum.covariance;  // the way is straight: both ends have the same axes
    const Eigen::Matrix3d covariance = KeyframeCovariance(map, id, context, kNone);
    EXPECT_LT((covariance - expected).norm(), 1e-3 * expected.norm()) << id.value;
  }
}

TEST(KeyframeCovariance, GrowsWithTheWayWhereWheelsReadWrongThroughout) {
  const MeasurementModel context = Context();
  const Map map = Chain(9, context.odometry_noise);
  for (const auto& [id, keyframe] : map.keyframes) {
    const double along = KeyframeCovariance(map, id, context, {0.02, 1e-9})(0, 0) -
                         (id.value == 0 ? 0.0 : KeyframeCovariance(map, id, context, kNone)(0, 0));
    const double expected = 0.02 * keyframe.T_map_base.translation.x();
    EXPECT_NEAR(along, expected * expected, 1e-3 * expected * expected) << id.value;
  }
}

TEST(KeyframeCovariance, FallsWithATieToAnOldPlace) {
  const MeasurementModel context = Context();
  Map map = Chain(9, context.odometry_noise);
  const double before = KeyframeCovariance(map, KeyframeId{8}, context, kNone).trace();
  PlanarMotion closing;
  closing.T_i_j = Rigid2(4.0, 0.0, 0.0);
  closing.covariance = 1e-6 * Eigen::Matrix3d::Identity();
  map = Apply(std::move(map), {AddLaserLinks{KeyframeId{8}, {MotionLink{KeyframeId{0}, closing}}}});
  EXPECT_LT(KeyframeCovariance(map, KeyframeId{8}, context, kNone).trace(), 0.1 * before);
}

TEST(KeyframeCovariance, ByTheLaserDoesNotDependOnTheFloorsOfTheWheels) {
  MeasurementModel context = Context();
  context.options.use_odometry = false;
  Map map = Chain(3, context.odometry_noise);
  for (const KeyframeId id : map.keyframes.Ids()) {
    Keyframe& keyframe = map.keyframes.Edit(id);
    if (keyframe.odometry_link.has_value()) keyframe.laser_links = {*keyframe.odometry_link};
  }
  const Eigen::Matrix3d before = KeyframeCovariance(map, KeyframeId{2}, context, kNone);
  context.odometry_noise.position_floor *= 10.0;
  context.odometry_noise.heading_floor *= 10.0;
  EXPECT_EQ(KeyframeCovariance(map, KeyframeId{2}, context, kNone), before);
}

TEST(KeyframeCovariance, IsPositiveDefiniteAndLandmarksOnlyLowerIt) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  const MeasurementModel context = world.Context();
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
  const MeasurementModel context = Context();
  Map map = Chain(2, context.odometry_noise);
  Keyframe alone;
  alone.stamp = Timestamp::FromSeconds(10);
  alone.features = std::make_shared<const FrameFeatures>();
  map = Apply(std::move(map), {AddKeyframe{KeyframeId{2}, alone}});
  EXPECT_GT(KeyframeCovariance(map, KeyframeId{2}, context, kNone).diagonal().minCoeff(), 1e3);
}

TEST(MapUncertainty, OfTwoKeyframesIsThatOfTheWayBetweenThem) {
  const MeasurementModel context = Context();
  const Map map = Chain(9, context.odometry_noise);
  const MapUncertainty uncertainty(map, TiesOf(map, context), kNone);
  const Eigen::Matrix3d half = uncertainty.CovarianceOf(KeyframeId{4});
  const Eigen::Matrix3d between = uncertainty.CovarianceBetween(KeyframeId{4}, KeyframeId{8});
  EXPECT_LT((between - half).norm(), 1e-3 * half.norm());  // four equal steps either way
  const Eigen::Matrix3d from_origin = uncertainty.CovarianceBetween(KeyframeId{0}, KeyframeId{8});
  EXPECT_LT((from_origin - uncertainty.CovarianceOf(KeyframeId{8})).norm(), 1e-3 * from_origin.norm());
}

// Of a straight chain whose wheels read one share wrong throughout it is that share, and noise only adds to it.
TEST(MapUncertainty, OfTheScaleIsThatOfItsWheels) {
  const MeasurementModel context = Context();
  const Map map = Chain(40, context.odometry_noise);
  const std::vector<MapTie> ties = TiesOf(map, context);
  const double noise = MapUncertainty(map, ties, kNone).ScaleSigma().value();
  const double both = MapUncertainty(map, ties, {0.02, 1e-9}).ScaleSigma().value();
  EXPECT_NEAR(both * both - noise * noise, 0.02 * 0.02, 1e-3 * 0.02 * 0.02);
  const double twice =
      MapUncertainty(Chain(80, context.odometry_noise), TiesOf(Chain(80, context.odometry_noise), context), kNone)
          .ScaleSigma()
          .value();
  EXPECT_NEAR(twice, noise / std::sqrt(2.0), 0.02 * noise);  // a random walk over twice the way
}

TEST(MapUncertainty, AMapOfOnePlaceHasNoScale) {
  const MeasurementModel context = Context();
  const Map map = Chain(1, context.odometry_noise);
  EXPECT_FALSE(MapUncertainty(map, TiesOf(map, context), kNone).ScaleSigma().has_value());
}

// The last keyframe of the world stays where it was, by its wheels, and sees another world.
Map Kidnapped(const test::SyntheticWorld& world, std::size_t keypoints) {
  auto features = std::make_shared<FrameFeatures>();
  features->keypoints.resize(keypoints);
  features->descriptors.resize(keypoints);
  features->grid = ImageGrid(features->keypoints);
  Keyframe keyframe = std::prev(world.map.keyframes.end())->second;
  keyframe.odometry_link = MotionLink{std::prev(world.map.keyframes.end())->first, PlanarMotion{}};
  keyframe.features = features;
  keyframe.landmarks.assign(keypoints, LandmarkId{});
  return Apply(world.map, {AddKeyframe{KeyframeId{world.map.next_keyframe_id}, keyframe}});
}

std::size_t CountDoubtful(const std::vector<MapTie>& ties) {
  return static_cast<std::size_t>(std::count_if(ties.begin(), ties.end(), [](const MapTie& t) { return t.doubtful; }));
}

TEST(MapTies, AStepOfTheWheelsIntoQuiteAnotherViewIsDoubtful) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  EXPECT_EQ(CountDoubtful(TiesOf(world.map, world.Context())), 0u);
  const Map carried = Kidnapped(world, 300);
  const std::vector<MapTie> ties = TiesOf(carried, world.Context());
  ASSERT_EQ(CountDoubtful(ties), 1u);
  EXPECT_EQ(ties.back().to, std::prev(carried.keyframes.end())->first);
  EXPECT_GT(ties.back().covariance(0, 0), 1.0);
}

TEST(MapTies, ADarkViewMakesNoStepDoubtful) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  EXPECT_EQ(CountDoubtful(TiesOf(Kidnapped(world, 20), world.Context())), 0u);
}

TEST(MapTies, ALaserThatSawTheStepMakesItCertain) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  Map map = Kidnapped(world, 300);
  const auto& [id, keyframe] = *std::prev(map.keyframes.end());
  map = Apply(std::move(map), {AddLaserLinks{id, {*keyframe.odometry_link}}});
  EXPECT_EQ(CountDoubtful(TiesOf(map, world.Context())), 0u);
}

// The last keyframe stands 20 m from the others, still sees `old` of their landmarks, and `fresh` ones of its own.
Map FarAway(const test::SyntheticWorld& world, int old, int fresh) {
  const auto& [last, keyframe] = *std::prev(world.map.keyframes.end());
  auto features = std::make_shared<FrameFeatures>();
  features->keypoints.resize(200);
  features->descriptors.resize(200);
  Keyframe far = keyframe;
  far.T_map_base = keyframe.T_map_base * Embed3(Rigid2(20.0, 0.0, 0.0));
  far.features = features;
  far.odometry_link.reset();
  far.landmarks.assign(200, LandmarkId{});
  std::vector<LandmarkId> seen;
  std::copy_if(keyframe.landmarks.begin(), keyframe.landmarks.end(), std::back_inserter(seen),
               [](LandmarkId id) { return id.valid(); });
  for (int i = 0; i < old; ++i) {
    far.landmarks[static_cast<std::size_t>(i)] = seen[static_cast<std::size_t>(i)];
  }
  const KeyframeId id{world.map.next_keyframe_id}, beside{id.value + 1};
  MapEdit edit{AddKeyframe{id, far}};
  far.landmarks.assign(200, LandmarkId{});
  edit.emplace_back(AddKeyframe{beside, far});
  for (int i = 0; i < fresh; ++i) {
    const auto keypoint = static_cast<std::uint32_t>(old + i);
    Landmark landmark;
    landmark.p_map = far.T_map_camera() * Eigen::Vector3d(0.0, 0.0, 2.0);
    landmark.observations = {{id, keypoint}, {beside, keypoint}};
    landmark.created_by = id;
    edit.emplace_back(AddLandmark{LandmarkId{world.map.next_landmark_id + static_cast<std::uint32_t>(i)}, landmark});
  }
  return Apply(world.map, edit);
}

TEST(MapTies, AFewLandmarksOfAnOldPlaceDoNotBringAPoseHome) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  const auto ties_to_old_place = [&world](const Map& map) {
    const std::vector<MapTie> ties = TiesOf(map, world.Context());
    return std::count_if(ties.begin(), ties.end(), [&world](const MapTie& tie) {
      return tie.source == TieSource::kLandmarks && tie.to.value == world.map.keyframes.size() && tie.from < tie.to;
    });
  };
  EXPECT_GT(ties_to_old_place(FarAway(world, 40, 10)), 0);
  EXPECT_EQ(ties_to_old_place(FarAway(world, 40, 90)), 0);
}

}  // namespace
}  // namespace planar_vslam
