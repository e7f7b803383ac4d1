#include "planar_vslam/optimize/bundle_adjustment.h"

#include <gtest/gtest.h>

#include <limits>

#include "planar_vslam/map/map_edit.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

double WorstPosition(const Map& map, const std::vector<Rigid3>& truth) {
  double worst = 0.0;
  for (const auto& [id, keyframe] : map.keyframes) {
    worst = std::max(worst, (keyframe.T_map_base.translation - truth[id.value].translation).norm());
  }
  return worst;
}

Rigid3 FromTilt(double roll, double pitch) { return {ExpSo3({roll, pitch, 0.0}), Eigen::Vector3d::Zero()}; }

class BundleAdjustment : public ::testing::TestWithParam<BundleSolver> {
 protected:
  static BundleResult Adjust(const Map& map, const BundleRequest& request, const MeasurementModel& context) {
    return AdjustBundle(map, request, context, GetParam());
  }
};
INSTANTIATE_TEST_SUITE_P(Solvers, BundleAdjustment, ::testing::Values(BundleSolver::kSchur, BundleSolver::kCeres));

TEST_P(BundleAdjustment, RecoversTruthFromPerturbedPosesAndPoints) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  Map map = test::Perturbed(world, 0.02, 0.01, 0.05, 4);
  MeasurementModel context = world.Context();
  context.options.max_iterations = 50;
  const BundleResult result = Adjust(map, WholeMapRequest(map), context);
  ASSERT_TRUE(result.converged) << result.message;
  EXPECT_LT(result.final_cost, 1e-2 * result.initial_cost);
  map = Apply(std::move(map), ToEdit(result));
  EXPECT_TRUE(Validate(map).empty());
  EXPECT_LT(WorstPosition(map, world.true_poses), 2e-3);
}

TEST_P(BundleAdjustment, OdometryHoldsTheScale) {
  // The whole map 10 % too large: vision alone cannot tell, odometry can.
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  for (const bool use_odometry : {true, false}) {
    Map map = Apply(world.map, {TransformMap{1.1, Rigid3()}});
    MeasurementModel context = world.Context();
    context.planar.mode = PlanarMode::kOff;
    context.options.use_odometry = use_odometry;
    context.options.max_iterations = 50;
    const BundleResult result = Adjust(map, WholeMapRequest(map), context);
    map = Apply(std::move(map), ToEdit(result));
    const auto span = [](const Map& m) {
      const Eigen::Vector3d a = m.keyframes.begin()->second.T_map_camera().translation;
      return (std::prev(m.keyframes.end())->second.T_map_camera().translation - a).norm();
    };
    const double scale = span(map) / span(world.map);
    EXPECT_NEAR(scale, use_odometry ? 1.0 : 1.1, 0.01) << use_odometry;
  }
}

TEST_P(BundleAdjustment, FloorPriorTakesOnlyKeyframesOnTheFloor) {
  test::SyntheticWorldOptions options;
  options.pixel_noise = 0.5;
  const test::SyntheticWorld world = test::MakeSyntheticWorld(options);
  Map lifted =
      Apply(world.map, {TransformMap{1.0, Rigid3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 0.3))}});
  MeasurementModel context = world.Context();
  context.options.max_iterations = 50;
  BundleRequest request = WholeMapRequest(lifted);
  request.free_keyframes.insert(request.free_keyframes.begin(), request.fixed_keyframes.begin(),
                                request.fixed_keyframes.end());
  request.fixed_keyframes.clear();
  const auto mean_height = [&](Map map) {
    map = Apply(std::move(map), ToEdit(Adjust(map, request, context)));
    double sum = 0.0;
    for (const auto& [id, keyframe] : map.keyframes) sum += keyframe.T_map_base.translation.z();
    return sum / static_cast<double>(map.keyframes.size());
  };
  EXPECT_NEAR(mean_height(lifted), 0.0, 0.02);
  for (const KeyframeId id : lifted.keyframes.Ids()) {
    Keyframe& keyframe = lifted.keyframes.Edit(id);
    keyframe.on_floor = false;
  }
  EXPECT_NEAR(mean_height(lifted), 0.3, 0.02);
}

class BundleAdjustmentOnFloor : public ::testing::TestWithParam<std::tuple<BundleSolver, PlanarMode>> {
 protected:
  static BundleResult Adjust(const Map& map, const BundleRequest& request, const MeasurementModel& context) {
    return AdjustBundle(map, request, context, std::get<0>(GetParam()));
  }
};

TEST_P(BundleAdjustmentOnFloor, PutsFreePosesOnTheFloorAndRecoversTruth) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  Map map = test::Perturbed(world, 0.02, 0.01, 0.05, 4);
  MeasurementModel context = world.Context();
  context.planar.mode = std::get<1>(GetParam());
  context.options.max_iterations = 50;
  const BundleResult result = Adjust(map, WholeMapRequest(map), context);
  ASSERT_TRUE(result.converged) << result.message;
  for (const auto& [id, T] : result.poses) {
    EXPECT_EQ(T.translation.z(), 0.0);
    EXPECT_EQ(T.R()(2, 2), 1.0);
  }
  map = Apply(std::move(map), ToEdit(result));
  EXPECT_LT(WorstPosition(map, world.true_poses), 2e-3);
}

TEST_P(BundleAdjustmentOnFloor, LeavesReleasedKeyframesTheirSixDegreesOfFreedom) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  Map ramp = Apply(world.map, {TransformMap{1.0, FromTilt(0.2, 0.1)}});
  for (const KeyframeId id : ramp.keyframes.Ids()) {
    Keyframe& keyframe = ramp.keyframes.Edit(id);
    keyframe.on_floor = false;
  }
  MeasurementModel context = world.Context();
  context.options.max_iterations = 50;
  context.planar.mode = PlanarMode::kOff;
  const BundleResult free = Adjust(ramp, WholeMapRequest(ramp), context);
  context.planar.mode = std::get<1>(GetParam());
  const BundleResult released = Adjust(ramp, WholeMapRequest(ramp), context);
  ASSERT_EQ(free.poses.size(), released.poses.size());
  for (std::size_t i = 0; i < free.poses.size(); ++i) {  // upright within what ramps are: a slope that is seen stays
    EXPECT_LT(LogSe3(free.poses[i].second.Inverse() * released.poses[i].second).norm(), 1e-3);
  }
}

INSTANTIATE_TEST_SUITE_P(SolversAndModes, BundleAdjustmentOnFloor,
                         ::testing::Combine(::testing::Values(BundleSolver::kSchur, BundleSolver::kCeres),
                                            ::testing::Values(PlanarMode::kSe2Xyz, PlanarMode::kHard)));

TEST_P(BundleAdjustment, SwayMakesNoOutliersOfSe2Xyz) {
  // Every keyframe saw the world from a base tilted by about half a degree.
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  Map map = world.map;
  std::mt19937 generator(5);
  std::normal_distribution<double> tilt(0.0, DegreesToRadians(0.5));
  for (const KeyframeId id : map.keyframes.Ids()) {
    Keyframe& keyframe = map.keyframes.Edit(id);
    const Eigen::Quaterniond sway = ExpSo3({tilt(generator), tilt(generator), 0.0});
    const Rigid3 T_camera_map =
        (Rigid3(sway * keyframe.T_map_base.rotation, keyframe.T_map_base.translation) * keyframe.T_base_camera)
            .Inverse();
    auto features = std::make_shared<FrameFeatures>(*keyframe.features);
    for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
      if (!keyframe.landmarks[i].valid()) continue;
      const Eigen::Vector3d p = T_camera_map * map.landmarks.At(keyframe.landmarks[i]).p_map;
      features->keypoints[i].pixel = world.camera.ProjectUndistorted(p).cast<float>();
    }
    keyframe.features = features;
  }
  MeasurementModel context = world.Context();
  context.options.max_iterations = 50;
  context.planar.mode = PlanarMode::kSe2Xyz;
  const std::size_t inflated = Adjust(map, WholeMapRequest(map), context).outliers.size();
  context.planar.mode = PlanarMode::kHard;
  const std::size_t hard = Adjust(map, WholeMapRequest(map), context).outliers.size();
  EXPECT_LT(4 * inflated, hard);
}

TEST_P(BundleAdjustment, NamesWrongObservationsAsOutliers) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  Map map = world.map;
  auto features = std::make_shared<FrameFeatures>(*map.keyframes.At(KeyframeId{2}).features);
  const std::vector<LandmarkId>& landmarks = map.keyframes.At(KeyframeId{2}).landmarks;
  const auto wrong = static_cast<std::size_t>(
      std::find_if(landmarks.begin(), landmarks.end(), [](LandmarkId id) { return id.valid(); }) - landmarks.begin());
  features->keypoints[wrong].pixel += Eigen::Vector2f(40.0F, 25.0F);
  map.keyframes.Edit(KeyframeId{2}).features = features;
  const BundleResult result = Adjust(map, WholeMapRequest(map), world.Context());
  ASSERT_EQ(result.outliers.size(), 1U);
  EXPECT_EQ(result.outliers[0].first, landmarks[wrong]);
  EXPECT_EQ(result.outliers[0].second, KeyframeId{2});
}

TEST_P(BundleAdjustment, KeepsWhatThePixelSigmaAllows) {
  test::SyntheticWorldOptions options;
  options.pixel_noise = 2.0;
  const test::SyntheticWorld world = test::MakeSyntheticWorld(options);
  MeasurementModel context = world.Context();
  const std::size_t outliers = Adjust(world.map, WholeMapRequest(world.map), context).outliers.size();
  context.pixel_sigma = 2.0;
  EXPECT_LT(Adjust(world.map, WholeMapRequest(world.map), context).outliers.size(), outliers / 4);
}

TEST_P(BundleAdjustment, GivesTheSameBitsEveryTime) {
  test::SyntheticWorldOptions options;
  options.pixel_noise = 0.7;
  const test::SyntheticWorld world = test::MakeSyntheticWorld(options);
  const Map map = test::Perturbed(world, 0.02, 0.01, 0.05, 5);
  const BundleResult first = Adjust(map, WholeMapRequest(map), world.Context());
  const BundleResult second = Adjust(map, WholeMapRequest(map), world.Context());
  ASSERT_EQ(first.points.size(), second.points.size());
  for (std::size_t i = 0; i < first.points.size(); ++i) EXPECT_EQ(first.points[i].second, second.points[i].second);
  for (std::size_t i = 0; i < first.poses.size(); ++i) {
    EXPECT_EQ(first.poses[i].second.translation, second.poses[i].second.translation);
    EXPECT_EQ(first.poses[i].second.rotation.coeffs(), second.poses[i].second.rotation.coeffs());
  }
}

TEST_P(BundleAdjustment, SaysWhenThereIsNothingToAdjust) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  BundleRequest no_landmarks = WholeMapRequest(world.map), no_keyframes = no_landmarks;
  no_landmarks.landmarks.clear();
  no_keyframes.fixed_keyframes.insert(no_keyframes.fixed_keyframes.end(), no_keyframes.free_keyframes.begin(),
                                      no_keyframes.free_keyframes.end());
  no_keyframes.free_keyframes.clear();
  for (const BundleRequest& request : {BundleRequest{}, no_landmarks, no_keyframes}) {
    const BundleResult result = Adjust(world.map, request, world.Context());
    EXPECT_FALSE(result.converged);
    EXPECT_FALSE(result.failed()) << "that is no failure";
    EXPECT_EQ(result.observations, 0u);
    EXPECT_FALSE(result.message.empty());
    EXPECT_TRUE(ToEdit(result).empty());
  }
}

TEST_P(BundleAdjustment, AFailureHasNoValues) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  Map map = world.map;
  map.landmarks.Edit(map.landmarks.begin()->first).p_map.x() = std::numeric_limits<double>::quiet_NaN();
  const BundleResult result = Adjust(map, WholeMapRequest(map), world.Context());
  EXPECT_TRUE(result.failed());
  EXPECT_FALSE(result.message.empty());
  EXPECT_TRUE(ToEdit(result).empty());
}

// The keyframe's features as a base tilted by `tilt` would see them.
void Tilt(const test::SyntheticWorld& world, const Rigid3& tilt, Keyframe* keyframe) {
  const Rigid3 T_camera_map = (keyframe->T_map_base * tilt * keyframe->T_base_camera).Inverse();
  auto features = std::make_shared<FrameFeatures>(*keyframe->features);
  for (std::size_t i = 0; i < keyframe->landmarks.size(); ++i) {
    if (!keyframe->landmarks[i].valid()) continue;
    const Eigen::Vector3d p = T_camera_map * world.true_points[keyframe->landmarks[i].value];
    features->keypoints[i].pixel = world.camera.ProjectUndistorted(p).cast<float>();
  }
  keyframe->features = features;
}

TEST_P(BundleAdjustment, LaserLinksHoldTheScaleWithoutWheels) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  Map map = Apply(world.map, {TransformMap{1.1, Rigid3()}});
  MeasurementModel context = world.Context();
  context.planar.mode = PlanarMode::kOff;
  context.options.use_odometry = false;
  context.options.max_iterations = 50;
  for (const KeyframeId id : map.keyframes.Ids()) {
    Keyframe& keyframe = map.keyframes.Edit(id);
    if (keyframe.odometry_link.has_value()) keyframe.laser_links = {*keyframe.odometry_link};
  }
  map = Apply(std::move(map), ToEdit(Adjust(map, WholeMapRequest(map), context)));
  const auto span = [](const Map& m) {
    const Eigen::Vector3d a = m.keyframes.begin()->second.T_map_camera().translation;
    return (std::prev(m.keyframes.end())->second.T_map_camera().translation - a).norm();
  };
  EXPECT_NEAR(span(map) / span(world.map), 1.0, 0.01);
}

TEST_P(BundleAdjustment, TheFloorsOfTheWheelsAreNotThoseOfTheLaser) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  Map map = test::Perturbed(world, 0.02, 0.01, 0.05, 4);
  for (const KeyframeId id : map.keyframes.Ids()) {
    Keyframe& keyframe = map.keyframes.Edit(id);
    if (keyframe.odometry_link.has_value()) keyframe.laser_links = {*keyframe.odometry_link};
  }
  MeasurementModel context = world.Context();
  context.options.use_odometry = false;
  const BundleResult before = Adjust(map, WholeMapRequest(map), context);
  context.odometry_noise.position_floor *= 10.0;
  context.odometry_noise.heading_floor *= 10.0;
  const BundleResult after = Adjust(map, WholeMapRequest(map), context);
  for (std::size_t i = 0; i < before.poses.size(); ++i) {
    EXPECT_EQ(before.poses[i].second.translation, after.poses[i].second.translation);
  }
}

TEST_P(BundleAdjustment, LetsGoOfAStepInWhichTheWheelsSlipped) {
  test::SyntheticWorldOptions options;
  options.pixel_noise = 0.5;
  const test::SyntheticWorld world = test::MakeSyntheticWorld(options);
  Map map = world.map;
  map.keyframes.Edit(KeyframeId{4}).odometry_link->motion.T_i_j.translation += Eigen::Vector2d(0.3, 0.1);
  MeasurementModel context = world.Context();
  context.options.max_iterations = 50;
  const auto worst = [&](double loss) {
    context.options.odometry_loss = loss;
    return WorstPosition(Apply(map, ToEdit(Adjust(map, WholeMapRequest(map), context))), world.true_poses);
  };
  const double robust = worst(BundleOptions{}.odometry_loss), trusting = worst(1e6);
  EXPECT_LT(robust, 0.01);
  EXPECT_GT(trusting, 2.0 * robust);
}

TEST_P(BundleAdjustment, LetsGoOfTheLevelWhereTheRobotTilts) {
  test::SyntheticWorldOptions options;
  options.pixel_noise = 0.5;
  const test::SyntheticWorld world = test::MakeSyntheticWorld(options);
  const Rigid3 tilt = FromTilt(0.0, DegreesToRadians(10.0));
  Map map = world.map;
  for (const KeyframeId id : map.keyframes.Ids()) {
    if (id.value >= 4) Tilt(world, tilt, &map.keyframes.Edit(id));
  }
  MeasurementModel context = world.Context();
  context.planar.mode = PlanarMode::kOff;
  context.options.max_iterations = 50;
  context.options.drop_outliers = false;  // from where the map starts all that the tilted ones see would be one
  const auto off = [&](double loss) {
    context.options.tilt_loss = loss;
    const Map adjusted = Apply(map, ToEdit(Adjust(map, WholeMapRequest(map), context)));
    const Rigid3 truth = world.true_poses[4] * tilt;
    return LogSe3(truth.Inverse() * adjusted.keyframes.At(KeyframeId{4}).T_map_base).tail<3>().norm();
  };
  const double robust = off(BundleOptions{}.tilt_loss), trusting = off(1e6);
  EXPECT_LT(robust, DegreesToRadians(0.3));
  EXPECT_GT(trusting, 2.0 * robust);
}

TEST_P(BundleAdjustment, FloorPointsLevelTheFloor) {
  test::SyntheticWorldOptions options;
  options.floor_points = 300;
  options.pixel_noise = 2.0;
  const test::SyntheticWorld world = test::MakeSyntheticWorld(options);
  const Map map = test::Perturbed(world, 0.0, 0.0, 0.005, 3);
  MeasurementModel context = world.Context();
  context.pixel_sigma = 2.0;
  context.planar.sigma_floor_point = 0.002;  // a floor that is known better than the images tell it
  const auto roughness = [&](bool floor_points) {
    context.planar.floor_points = floor_points;
    const Map adjusted = Apply(map, ToEdit(Adjust(map, WholeMapRequest(map), context)));
    double sum = 0.0;
    int count = 0;
    for (const auto& [id, landmark] : adjusted.landmarks) {
      if (world.true_points[id.value].z() != 0.0) continue;
      sum += std::abs(landmark.p_map.z());
      ++count;
    }
    EXPECT_GT(count, 100);
    return sum / count;
  };
  EXPECT_LT(roughness(true), 0.8 * roughness(false));
}

TEST(BundleOptions, NameWhatIsWrong) {
  BundleOptions options;
  EXPECT_TRUE(options.Problems().empty());
  options.max_iterations = 0;
  options.tilt_loss = -1.0;
  EXPECT_EQ(options.Problems().size(), 2U);
}

}  // namespace
}  // namespace planar_vslam
