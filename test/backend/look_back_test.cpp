#include "planar_vslam/backend/look_back.h"

#include <gtest/gtest.h>

#include <limits>

#include "loop_testing.h"
#include "map_testing.h"

namespace planar_vslam {
namespace {

using test::Driver;

// What a step of the wheels measured is no number: no adjustment that it takes part in can succeed.
Map WithBrokenOdometry(Map map, KeyframeId id) {
  map.keyframes.Edit(id).odometry_link->motion.T_i_j.translation.x() = std::numeric_limits<double>::quiet_NaN();
  return map;
}

class LookBackTest : public test::LoopTest {
 protected:
  LookBackTest() {
    mapper_.model = context_;
    mapper_.systematic = test::kSystematic;
  }
  Eigen::Matrix3d CovarianceOf(const Map& map, KeyframeId id) const {
    return MapUncertainty(map, TiesOf(map, context_), test::kSystematic).CovarianceOf(id);
  }
  LookBackOutcome LookBackFrom(const Map& map) const {
    MapDrift drift(context_, test::kSystematic);
    return LookBack(map, std::prev(map.keyframes.end())->first, mapper_, &drift);
  }
  void ExpectHome(const Map& map, KeyframeId newest) const {
    for (int k = 0; k < kViews; ++k) {
      const KeyframeId id{newest.value - static_cast<std::uint32_t>(k)};
      EXPECT_LT(Distance(map.keyframes.At(id).T_map_base, TrueView(kViews - 1 - k)), 0.01) << id.value;
    }
  }

  MapperContext mapper_;
};

TEST_F(LookBackTest, ClosesALoopAndTakesTheDriftOut) {
  const Driver driver = ComeBack(test::kDrift);
  const LookBackOutcome outcome = LookBackFrom(driver.map());
  EXPECT_EQ(outcome.keyframe, driver.newest());
  EXPECT_EQ(outcome.failure, "");
  ASSERT_TRUE(outcome.closed.has_value());
  const LoopClosure& closed = *outcome.closed;
  EXPECT_EQ(Validate(*closed.map), std::vector<std::string>{});
  EXPECT_TRUE(closed.bundle.converged);
  ExpectHome(*closed.map, driver.newest());
  // The loop says how far the keyframe was off: where it stood by what the drift had made of its true pose.
  EXPECT_LT(closed.loop.old.value, world_.true_poses.size());
  const Rigid3 T_true = driver.map().keyframes.At(driver.newest()).T_map_base.Inverse() * TrueView(kViews - 1);
  EXPECT_LT(Distance(closed.loop.T_before_after, T_true), 0.01);
  // What is known of the keyframe is what the closed map knows.
  EXPECT_TRUE(outcome.covariance.isApprox(CovarianceOf(*closed.map, driver.newest())));
  EXPECT_LT(outcome.covariance.trace(), 0.2 * CovarianceOf(driver.map(), driver.newest()).trace());
}

TEST_F(LookBackTest, AKidnappedRobotFindsHome) {
  KeyframeId kidnapped;
  const Driver driver = ComeBackKidnapped(test::kKidnapped, &kidnapped);
  const LookBackOutcome outcome = LookBackFrom(driver.map());
  ASSERT_TRUE(outcome.closed.has_value()) << outcome.failure;
  const Map& map = *outcome.closed->map;
  EXPECT_EQ(Validate(map), std::vector<std::string>{});
  ExpectHome(map, driver.newest());
  EXPECT_TRUE(driver.map().keyframes.At(kidnapped).odometry_link.has_value());
  EXPECT_FALSE(map.keyframes.At(kidnapped).odometry_link.has_value()) << "its wheels are not believed";
}

TEST_F(LookBackTest, WithoutALoopItOnlyTellsTheCovariance) {
  Driver driver(world_);
  for (int k = 0; k < 4; ++k) driver.Drive(Rigid2(0.5, 0.0, 0.0), Blank());
  const LookBackOutcome outcome = LookBackFrom(driver.map());
  EXPECT_FALSE(outcome.closed.has_value());
  EXPECT_EQ(outcome.failure, "");
  EXPECT_TRUE(outcome.covariance.isApprox(CovarianceOf(driver.map(), driver.newest())));
}

TEST_F(LookBackTest, AMapThatIsNotMetricHasNoCovariance) {
  const Driver driver = ComeBack(test::kDrift);
  const Map map = Apply(driver.map(), {SetMetric{false}});
  const LookBackOutcome outcome = LookBackFrom(map);
  EXPECT_FALSE(outcome.closed.has_value());
  EXPECT_TRUE(outcome.covariance.isZero());
}

TEST_F(LookBackTest, ALoopWhoseAdjustmentFailsIsNotClosed) {
  const Driver driver = ComeBack(test::kDrift);
  const Map map = WithBrokenOdometry(driver.map(), KeyframeId{12});
  const LookBackOutcome outcome = LookBackFrom(map);
  EXPECT_FALSE(outcome.closed.has_value());
  EXPECT_EQ(outcome.failure.rfind("bundle adjustment: ", 0), 0u) << outcome.failure;
  EXPECT_TRUE(outcome.covariance.isApprox(CovarianceOf(map, driver.newest())));
}

TEST_F(LookBackTest, ItsCorrectionLeadsFromTheSnapshotToTheClosedMap) {
  KeyframeId kidnapped;
  for (const Driver& driver : {ComeBack(test::kDrift), ComeBackKidnapped(test::kKidnapped, &kidnapped)}) {
    const LookBackOutcome outcome = LookBackFrom(driver.map());
    ASSERT_TRUE(outcome.closed.has_value());
    const Map rebased = Rebase(driver.map(), outcome.closed->correction);
    EXPECT_EQ(Validate(rebased), std::vector<std::string>{});
    test::ExpectSameMap(rebased, *outcome.closed->map);
  }
}

TEST_F(LookBackTest, GivesTheSameMapEveryTime) {
  const Driver driver = ComeBack(test::kDrift);
  const LookBackOutcome a = LookBackFrom(driver.map()), b = LookBackFrom(driver.map());
  for (const auto& [id, landmark] : a.closed->map->landmarks) {
    EXPECT_EQ(landmark.p_map, b.closed->map->landmarks.At(id).p_map);
  }
}

double MeanPositionError(const Map& map, const test::SyntheticWorld& world) {
  double sum = 0.0;
  for (const auto& [id, keyframe] : map.keyframes) {
    sum += (keyframe.T_map_base.translation - world.true_poses[id.value].translation).norm();
  }
  return sum / static_cast<double>(map.keyframes.size());
}

test::SyntheticWorld NoisyWorld() {
  test::SyntheticWorldOptions options;
  options.pixel_noise = 0.3;
  return test::MakeSyntheticWorld(options);
}

TEST(AdjustWholeMap, PullsAPerturbedMapToTheTruth) {
  const test::SyntheticWorld world = NoisyWorld();
  const Map perturbed = test::Perturbed(world, 0.02, 0.005, 0.03, 11);
  const Expected<AdjustedMap> adjusted = AdjustWholeMap(perturbed, world.Context());
  ASSERT_TRUE(adjusted.ok());
  EXPECT_TRUE(Validate(adjusted->map).empty());
  EXPECT_TRUE(adjusted->bundle.converged);
  EXPECT_GT(adjusted->bundle.observations, 500u);
  EXPECT_LT(MeanPositionError(adjusted->map, world), 0.2 * MeanPositionError(perturbed, world));
  test::ExpectSameMap(Rebase(perturbed, adjusted->correction), adjusted->map);
}

// The second half of the keyframes stands on a ramp that nobody noticed: mapped level, held to the floor.
TEST(AdjustWholeMap, LetsGoOfTheFloorWhereImagesShowARamp) {
  const test::SyntheticWorld world = NoisyWorld();
  const Rigid3 tilt(ExpSo3(Eigen::Vector3d(0.0, DegreesToRadians(-5.0), 0.0)), Eigen::Vector3d::Zero());
  constexpr std::uint32_t kFoot = 4;
  Map map = world.map;
  for (const KeyframeId id : map.keyframes.Ids()) {
    if (id.value < kFoot) continue;
    Keyframe& keyframe = map.keyframes.Edit(id);  // the camera is where it was, its mount leans back as the base tips
    keyframe.T_base_camera = tilt.Inverse() * keyframe.T_base_camera;
  }
  MeasurementModel context = world.Context();
  context.options.max_iterations = 50;
  context.options.drop_outliers = false;  // from a level base all that the tilted ones see would be one
  const Expected<AdjustedMap> adjusted = AdjustWholeMap(map, context);
  ASSERT_TRUE(adjusted.ok());
  for (const auto& [id, keyframe] : adjusted->map.keyframes) {
    EXPECT_EQ(keyframe.on_floor, id.value < kFoot) << id.value;
    const double off = LogSo3(keyframe.T_map_base.rotation.inverse() * world.true_poses[id.value].rotation *
                              (id.value < kFoot ? Rigid3() : tilt).rotation)
                           .norm();
    EXPECT_LT(off, DegreesToRadians(0.5)) << id.value;
  }
  test::ExpectSameMap(Rebase(map, adjusted->correction), adjusted->map);
}

TEST(AdjustWholeMap, SaysWhyItFailed) {
  const test::SyntheticWorld world = NoisyWorld();
  const Expected<AdjustedMap> adjusted = AdjustWholeMap(WithBrokenOdometry(world.map, KeyframeId{3}), world.Context());
  ASSERT_FALSE(adjusted.ok());
  EXPECT_FALSE(adjusted.error().message.empty());
}

TEST(AdjustWholeMap, LeavesAMapThatHasNothingToAdjustAsItIs) {
  const test::SyntheticWorld world = NoisyWorld();
  MapEdit edit;
  for (std::uint32_t k = 1; k < world.map.next_keyframe_id; ++k) edit.emplace_back(EraseKeyframe{KeyframeId{k}});
  const Map single = Apply(world.map, edit);
  const Expected<AdjustedMap> adjusted = AdjustWholeMap(single, world.Context());
  ASSERT_TRUE(adjusted.ok());
  EXPECT_EQ(adjusted->bundle.observations, 0u);
  test::ExpectSameMap(adjusted->map, single);
}

}  // namespace
}  // namespace planar_vslam
