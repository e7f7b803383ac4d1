#include "planar_vslam/localize/sight_belief.h"

#include <gtest/gtest.h>

#include <optional>
#include <random>

#include "planar_vslam/localize/pose_search.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

test::SyntheticWorld MakeWorld(std::uint32_t seed) {
  test::SyntheticWorldOptions options;
  options.seed = seed;
  return MakeSyntheticWorld(options);
}

constexpr double kStep = 0.22;  // m between views: each is a new place

class Driver {
 public:
  // `expected`: where odometry takes the robot to be at its first place, to `distance` m and 20 degrees a metre.
  Driver(const test::SyntheticWorld& shown, const Map& map, const std::optional<Rigid2>& expected = std::nullopt,
         double distance = 0.5)
      : shown_(shown), belief_(std::make_shared<SightMap>(std::make_shared<const Map>(map))) {
    if (!expected.has_value()) return;
    expected_ = SettledPlace{*expected};
    const double angle = DegreesToRadians(20.0) * distance;
    expected_->covariance = Eigen::Vector3d(distance, distance, angle).cwiseAbs2().asDiagonal();
  }

  // From here on it looks in another direction than the map's robot did, rad. Odometry does not notice.
  void Turn(double angle) { turned_ = Rigid2(0.0, 0.0, angle); }

  // The robot drives to its next place and sees this share of the landmarks there; `of_its_own`: the part of it of
  // those with odd numbers.
  void See(double share, double of_its_own = 1.0) {
    const Rigid3 T_map_base = test::SyntheticPose(x_) * Embed3(turned_);
    const Rigid2 moved = ProjectToPlane((test::SyntheticPose(x_ - kStep) * Embed3(turned_)).Inverse() * T_map_base);
    if (views_ > 0) belief_.Move(moved);
    if (views_ > 0 && expected_.has_value()) expected_->T_map_base = expected_->T_map_base * moved;
    const auto view = test::Observe(shown_, T_map_base * shown_.T_base_camera, 0.5, ++views_);
    auto features = std::make_shared<FrameFeatures>(*view.features);
    for (std::size_t i = 0; i < features->descriptors.size(); ++i) {
      const double of_all = view.landmarks[i].value % 2 == 0 ? 1.0 : of_its_own;
      if (unit_(generator_) > share * of_all)
        features->descriptors[i] = {generator_(), generator_(), generator_(), generator_()};
    }
    ASSERT_TRUE(views_ == 1 || SightBelief::IsNewPlace(moved));
    belief_.AddView({features, shown_.T_base_camera, shown_.camera, PlanarPriorOptions{}, 1.0}, {}, expected_);
    truth_ = ProjectToPlane(T_map_base);
    x_ += kStep;
    if (expected_.has_value() && belief_.Believed().has_value()) expected_ = *belief_.Believed();
  }

  const SightBelief& belief() const { return belief_; }
  const Rigid2& truth() const { return truth_; }
  const std::optional<SettledPlace>& expected() const { return expected_; }

 private:
  const test::SyntheticWorld& shown_;
  SightBelief belief_;
  std::optional<SettledPlace> expected_;
  double x_ = 0.4;
  Rigid2 turned_;
  std::uint32_t views_ = 0;
  Rigid2 truth_;
  std::mt19937_64 generator_{7};
  std::uniform_real_distribution<double> unit_{0.0, 1.0};
};

// The map, and once more beside it. `of_one_kind`: there, only landmarks with even numbers, and in another order.
Map Twice(const test::SyntheticWorld& world, const Rigid3& T_map_twin, bool of_one_kind = false) {
  std::mt19937_64 generator(3);
  std::uniform_real_distribution<double> anywhere(-1.0, 1.0);
  const auto count = static_cast<std::uint32_t>(world.map.keyframes.size());
  const auto landmarks = static_cast<std::uint32_t>(world.map.landmarks.size());
  MapEdit edit;
  for (const bool twin : {false, true}) {
    for (const auto& [id, keyframe] : world.map.keyframes) {
      Keyframe copy = keyframe;
      copy.T_map_base = twin ? T_map_twin * keyframe.T_map_base : keyframe.T_map_base;
      copy.landmarks.assign(keyframe.landmarks.size(), LandmarkId{});
      copy.odometry_link.reset();
      copy.linked_by.clear();
      edit.emplace_back(AddKeyframe{KeyframeId{id.value + (twin ? count : 0)}, copy});
    }
  }
  for (const bool twin : {false, true}) {
    for (const auto& [id, landmark] : world.map.landmarks) {
      Landmark copy = landmark;
      if (twin && of_one_kind && id.value % 2 != 0) continue;
      if (twin && of_one_kind) copy.p_map += Eigen::Vector3d(anywhere(generator), anywhere(generator), 0.0);
      if (twin) copy.p_map = T_map_twin * copy.p_map;
      for (Observation& o : copy.observations) o.keyframe.value += twin ? count : 0;
      copy.created_by = copy.observations.front().keyframe;
      edit.emplace_back(AddLandmark{LandmarkId{id.value + (twin ? landmarks : 0)}, copy});
    }
  }
  Map map;
  map.octave_scales = world.map.octave_scales;
  map.metric = true;
  return Apply(std::move(map), edit);
}

TEST(SightBelief, KnowsAtOnceWhereAViewShowsNearlyAll) {
  const test::SyntheticWorld world = MakeWorld(1);
  Driver driver(world, world.map);
  driver.See(0.9);
  ASSERT_TRUE(driver.belief().Believed().has_value());
  EXPECT_LT((driver.belief().Believed()->T_map_base.translation - driver.truth().translation).norm(), 0.03);
}

TEST(SightBelief, NeedsSeveralPlacesWhereViewsShowLittle) {
  const test::SyntheticWorld world = MakeWorld(2);
  Driver driver(world, world.map);
  for (int place = 0; place < 2; ++place) {
    driver.See(0.3);
    EXPECT_FALSE(driver.belief().Believed().has_value()) << place;
  }
  for (int place = 2; place < 6; ++place) driver.See(0.3);
  ASSERT_TRUE(driver.belief().Believed().has_value());
  EXPECT_LT((driver.belief().Believed()->T_map_base.translation - driver.truth().translation).norm(), 0.05);
}

TEST(SightBelief, NeverBelievesInARoomTheMapDoesNotKnow) {
  const test::SyntheticWorld world = MakeWorld(3), other = MakeWorld(4);
  Driver driver(other, world.map);
  for (int place = 0; place < 6; ++place) {
    driver.See(1.0);
    EXPECT_FALSE(driver.belief().Believed().has_value()) << place;
  }
}

TEST(SightBelief, TwinsAreToldApartByWhereTheRobotIsExpected) {
  const test::SyntheticWorld world = MakeWorld(5);
  const Rigid3 T_map_twin = Embed3(Rigid2(0.0, 12.0, 0.3));
  const Map map = Twice(world, T_map_twin);
  Driver lost(world, map);
  for (int place = 0; place < 4; ++place) {
    lost.See(0.9);
    EXPECT_FALSE(lost.belief().Believed().has_value()) << place;
  }
  Driver expecting(world, map, ProjectToPlane(test::SyntheticPose(0.4)) * Rigid2(0.3, -0.2, 0.1));
  expecting.See(0.9);
  ASSERT_TRUE(expecting.belief().Believed().has_value());
  EXPECT_LT((expecting.belief().Believed()->T_map_base.translation - expecting.truth().translation).norm(), 0.03);
}

// All landmarks on a wall 12 m ahead.
test::SyntheticWorld WithFarWall(std::uint32_t seed) {
  constexpr double kWall = 12.0;  // m
  test::SyntheticWorld world = MakeWorld(seed);
  MapEdit edit;
  for (const auto& [id, landmark] : world.map.landmarks) {
    Eigen::Vector3d& p = world.true_points[id.value];
    p.y() = kWall;
    edit.emplace_back(SetLandmarkPosition{id, p});
  }
  world.map = Apply(std::move(world.map), edit);
  return world;
}

TEST(SightBelief, AFarWallAloneIsNoPlace) {
  const test::SyntheticWorld world = WithFarWall(8);
  Driver driver(world, world.map);
  for (int place = 0; place < 4; ++place) {
    driver.See(0.9);
    EXPECT_FALSE(driver.belief().Believed().has_value()) << place;
    ASSERT_FALSE(driver.belief().places().empty());
    EXPECT_GT(driver.belief().places().front().agreement.share(), 0.4);
  }
}

TEST(SightBelief, AnotherThingOfTheSameKindIsNoPlace) {
  const test::SyntheticWorld world = MakeWorld(7);
  const Map map = Twice(world, Embed3(Rigid2(0.0, 12.0, 0.3)), true);
  Driver elsewhere(world, map), there(world, map);
  for (int place = 0; place < 6; ++place) {
    elsewhere.See(0.9, 0.0);
    EXPECT_FALSE(elsewhere.belief().Believed().has_value()) << place;
    ASSERT_FALSE(elsewhere.belief().places().empty());
    EXPECT_TRUE(IsSamePlace(elsewhere.belief().places().front().T_map_base, elsewhere.truth()));
    EXPECT_GT(elsewhere.belief().places().front().agreement.share(), 0.4);
  }
  there.See(0.9);
  ASSERT_TRUE(there.belief().Believed().has_value());
  EXPECT_TRUE(IsSamePlace(there.belief().Believed()->T_map_base, there.truth()));
}

// What is unique is recognised less than plain corners are: where the map has looked from there, that is another thing
// of the same kind.
TEST(SightBelief, LittleThatIsUniqueIsEnoughFromAnotherSideOnly) {
  const test::SyntheticWorld world = MakeWorld(7);
  const Map map = Twice(world, Embed3(Rigid2(0.0, 12.0, 0.3)), true);
  constexpr double kAlike = 0.5, kUnique = 0.35, kOtherSide = DegreesToRadians(50.0);
  Driver as_mapped(world, map), from_another_side(world, map), another_thing(world, map);
  from_another_side.Turn(kOtherSide);
  another_thing.Turn(kOtherSide);
  for (int place = 0; place < 6; ++place) {
    as_mapped.See(kAlike, kUnique);
    EXPECT_FALSE(as_mapped.belief().Believed().has_value()) << place;
    another_thing.See(kAlike, 0.0);
    EXPECT_FALSE(another_thing.belief().Believed().has_value()) << place;
    if (!from_another_side.belief().Believed().has_value()) from_another_side.See(kAlike, kUnique);
  }
  ASSERT_TRUE(from_another_side.belief().Believed().has_value());
  EXPECT_TRUE(IsSamePlace(from_another_side.belief().Believed()->T_map_base, from_another_side.truth()));
}

// Images from before the wheels slipped still agree with where odometry leads: they have told, and do not tell again.
TEST(SightBelief, WheelsThatSlipAreNotConfirmedByWhatWasSeenBefore) {
  constexpr double kSlip = DegreesToRadians(4.0);
  const test::SyntheticWorld world = MakeWorld(9);
  Driver driver(world, world.map, ProjectToPlane(test::SyntheticPose(0.4)), 0.02);
  for (int place = 0; place < 3; ++place) driver.See(0.3);
  ASSERT_TRUE(driver.belief().Believed().has_value()) << "odometry and images agree";
  driver.Turn(kSlip);
  bool noticed = false;
  for (int place = 3; place < 9; ++place) {
    driver.See(0.3);
    if (!driver.belief().Believed().has_value()) continue;
    EXPECT_LT(std::abs(WrapAngle(driver.expected()->T_map_base.angle - driver.truth().angle)), 0.3 * kSlip) << place;
    noticed = true;
  }
  EXPECT_TRUE(noticed);
}

TEST(SightBelief, SeveralPlacesHaveToAgreeWhereTheRobotIsExpectedSomewhereAround) {
  const test::SyntheticWorld world = MakeWorld(10);
  const Rigid2 about = ProjectToPlane(test::SyntheticPose(0.4)) * Rigid2(0.3, -0.2, 0.1);
  Driver well_known(world, world.map, ProjectToPlane(test::SyntheticPose(0.4)), 0.05), around(world, world.map, about);
  well_known.See(0.3);
  EXPECT_TRUE(well_known.belief().Believed().has_value());
  for (int place = 0; place < 2; ++place) {
    around.See(0.3);
    EXPECT_FALSE(around.belief().Believed().has_value()) << place;
  }
}

TEST(SightBelief, WhatIsFarFromWhereTheRobotIsExpectedHasToShowNearlyAll) {
  const test::SyntheticWorld world = MakeWorld(6);
  Driver driver(world, world.map, Rigid2(0.4, 8.0, 1.0));
  for (int place = 0; place < 6; ++place) {
    driver.See(0.3);
    EXPECT_FALSE(driver.belief().Believed().has_value()) << place;
  }
  for (int place = 0; place < 15; ++place) {
    if (driver.belief().Believed().has_value()) break;
    driver.See(1.0);
  }
  ASSERT_TRUE(driver.belief().Believed().has_value());
  EXPECT_TRUE(IsSamePlace(driver.belief().Believed()->T_map_base, driver.truth()));
}

}  // namespace
}  // namespace planar_vslam
