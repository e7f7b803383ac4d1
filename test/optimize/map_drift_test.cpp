#include "planar_vslam/optimize/map_drift.h"

#include <gtest/gtest.h>

#include <random>

#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

constexpr SystematicErrors kSystematic{0.005, 0.0005};

KeyframeId K(std::size_t value) { return KeyframeId{static_cast<std::uint32_t>(value)}; }

void ExpectSame(const std::vector<MapTie>& a, const std::vector<MapTie>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    EXPECT_EQ(a[k].from, b[k].from);
    EXPECT_EQ(a[k].to, b[k].to);
    EXPECT_EQ(a[k].covariance, b[k].covariance);
    EXPECT_EQ(a[k].source, b[k].source);
    EXPECT_EQ(a[k].doubtful, b[k].doubtful);
  }
}

// Writes what bundle adjustment, culling and the wheels do to a map, at random.
class Editor {
 public:
  explicit Editor(unsigned seed) : generator_(seed) {}

  MapEditStep Step(const Map& map) {
    const KeyframeId keyframe = AnyOf(map.keyframes);
    const LandmarkId landmark = AnyOf(map.landmarks);
    const auto& [before, last] = *std::prev(map.keyframes.end());
    switch (std::uniform_int_distribution<int>(0, 11)(generator_)) {
      case 0:
      case 1:
        return SetKeyframePose{keyframe, map.keyframes.At(keyframe).T_map_base * Nudge()};
      case 2:
      case 3:
        return SetLandmarkPosition{landmark, Nudge() * map.landmarks.At(landmark).p_map};
      case 4:
        return EraseObservation{landmark, map.landmarks.At(landmark).observations.front().keyframe};
      case 5:
        return MergeLandmarks{landmark, AnyOf(map.landmarks)};
      case 6:
        if (map.keyframes.size() > 20) return EraseKeyframe{keyframe};
        return EraseOdometryLink{keyframe};
      case 7:
        return CountSightings{{landmark}, {landmark}};
      case 8:
        return EraseLandmarks{{landmark}};
      case 9: {  // seen by nobody yet, or by what the last one saw
        Keyframe next = last;
        next.T_map_base = last.T_map_base * Nudge();
        next.odometry_link = MotionLink{before, {}};
        next.odometry_link->motion.covariance = 1e-4 * Eigen::Matrix3d::Identity();
        return AddKeyframe{K(map.next_keyframe_id), next};
      }
      case 10:
        return AddLaserLinks{before, {MotionLink{keyframe, Measured()}}};
      default:
        return SetOffFloor{{keyframe}};
    }
  }

 private:
  template <class Id, class Value>
  Id AnyOf(const IdMap<Id, Value>& entries) {
    return entries.EntryAt(std::uniform_int_distribution<std::size_t>(0, entries.size() - 1)(generator_)).first;
  }
  Rigid3 Nudge() {
    std::normal_distribution<double> normal(0.0, 0.05);
    return Embed3(Rigid2(normal(generator_), normal(generator_), normal(generator_)));
  }
  PlanarMotion Measured() {
    PlanarMotion motion;
    motion.T_i_j = Rigid2(0.1, 0.0, 0.0);
    motion.covariance = 1e-4 * Eigen::Matrix3d::Identity();
    return motion;
  }

  std::mt19937 generator_;
};

class KeptTies : public testing::TestWithParam<unsigned> {};

TEST_P(KeptTies, AreThoseMadeAnewWhateverBecomesOfTheMap) {
  test::SyntheticWorldOptions options;
  options.keyframes = 24;
  options.points = 600;
  const test::SyntheticWorld world = test::MakeSyntheticWorld(options);
  // Larger than it is, so that distances driven count.
  Map map = Apply(world.map, {TransformMap{4.0, Rigid3()}, SetMetric{}});
  Editor editor(GetParam());
  MapTies ties(world.Context());
  for (int round = 0; round < 150; ++round) {
    for (int step = 0; step < 3; ++step) map = Apply(std::move(map), {editor.Step(map)});
    ties.Follow(map);
    ExpectSame(ties.All(), TiesOf(map, world.Context()));
    if (HasFailure()) FAIL() << "round " << round;
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, KeptTies, testing::Range(0U, 4U));

TEST(KeptTies, NothingIsTiedAnewWhereNothingHasChanged) {
  const test::SyntheticWorld world = test::MakeSyntheticWorld({});
  const Map map = Apply(world.map, {SetMetric{}});
  MapTies ties(world.Context());
  EXPECT_EQ(ties.Follow(map).retied.size(), map.keyframes.size());
  const LandmarkId seen = map.landmarks.begin()->first;
  EXPECT_TRUE(ties.Follow(Apply(map, {CountSightings{{seen}, {seen}}})).retied.empty());
}

// Rounds of a hall by wheels and laser, each keyframe linked to the ones before it and to that of the round before.
class Rounds {
 public:
  Rounds() {
    map_.metric = true;
    map_.octave_scales = {1.0};
  }

  void Drive(std::size_t keyframes) {
    for (std::size_t k = 0; k < keyframes; ++k) Add();
  }
  void Nudge(KeyframeId id) {
    const Rigid3 nudge = Embed3(Rigid2(1e-3, -2e-3, 1e-3));
    map_ = Apply(std::move(map_), {SetKeyframePose{id, map_.keyframes.At(id).T_map_base * nudge}});
  }
  void Edit(const MapEditStep& step) { map_ = Apply(std::move(map_), {step}); }
  const Map& map() const { return map_; }
  KeyframeId newest() const { return std::prev(map_.keyframes.end())->first; }

 private:
  static constexpr std::size_t kRound = 250;
  static Rigid2 PoseOf(std::size_t k) {
    const double angle = 2.0 * M_PI * static_cast<double>(k) / kRound;
    return Rigid2(12.0 * std::sin(angle), 12.0 - 12.0 * std::cos(angle), angle);
  }
  static MotionLink LinkTo(std::size_t from, std::size_t k, double sigma) {
    PlanarMotion motion;
    motion.T_i_j = PoseOf(from).Inverse() * PoseOf(k);
    motion.covariance = Eigen::Vector3d(sigma, sigma, 0.5 * sigma).cwiseAbs2().asDiagonal();
    return {K(from), motion};
  }
  void Add() {
    const std::size_t k = map_.next_keyframe_id;
    Keyframe keyframe;
    keyframe.stamp = Timestamp::FromSeconds(static_cast<double>(k));
    keyframe.T_map_base = Embed3(PoseOf(k));
    keyframe.features = std::make_shared<const FrameFeatures>();
    if (k > 0) keyframe.odometry_link = LinkTo(k - 1, k, 0.01);
    for (const std::size_t back : {kRound, kRound - 1, std::size_t{2}, std::size_t{1}}) {
      if (k >= back) keyframe.laser_links.push_back(LinkTo(k - back, k, 0.005));
    }
    map_ = Apply(std::move(map_), {AddKeyframe{K(k), std::move(keyframe)}});
  }

  Map map_;
};

class MapDriftTest : public testing::Test {
 protected:
  MapDriftTest() : drift_(test::MakeSyntheticWorld({}).Context(), kSystematic) {}

  void ExpectExact(const Map& map) {
    drift_.Follow(map);
    const Eigen::Matrix3d exact = drift_.Uncertainty().CovarianceOf(std::prev(map.keyframes.end())->first);
    EXPECT_TRUE(drift_.CovarianceOfNewest().isApprox(exact, 1e-9)) << drift_.CovarianceOfNewest() << "\n\n"
                                                                   << exact << "\n at " << map.keyframes.size();
  }

  Rounds rounds_;
  MapDrift drift_;
};

TEST_F(MapDriftTest, KnowsASmallMapsNewestKeyframeToTheBit) {
  rounds_.Drive(40);
  drift_.Follow(rounds_.map());
  EXPECT_EQ(drift_.CovarianceOfNewest(), drift_.Uncertainty().CovarianceOf(rounds_.newest()));
}

TEST_F(MapDriftTest, FollowsALargeMapThatGrowsAndIsAdjusted) {
  rounds_.Drive(420);
  for (int round = 0; round < 40; ++round) {
    rounds_.Drive(2);
    const KeyframeId newest = rounds_.newest();
    for (const std::uint32_t back : {1U, 5U, 20U, 249U}) rounds_.Nudge(KeyframeId{newest.value - back});
    ExpectExact(rounds_.map());
  }
}

TEST_F(MapDriftTest, FollowsWhatChangesFarAway) {
  rounds_.Drive(600);
  ExpectExact(rounds_.map());
  rounds_.Nudge(KeyframeId{130});
  ExpectExact(rounds_.map());
  rounds_.Edit(EraseKeyframe{KeyframeId{200}});
  ExpectExact(rounds_.map());
  rounds_.Edit(EraseKeyframe{KeyframeId{0}});
  ExpectExact(rounds_.map());
  rounds_.Edit(TransformMap{1.0, Embed3(Rigid2(3.0, -2.0, 1.0))});
  ExpectExact(rounds_.map());
  rounds_.Drive(3);
  ExpectExact(rounds_.map());
}

}  // namespace
}  // namespace planar_vslam
