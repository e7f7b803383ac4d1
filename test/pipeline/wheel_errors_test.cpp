#include "planar_vslam/pipeline/wheel_errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "planar_vslam/map/map_edit.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

// Lengths and turns that the wheels read, as multiples of the true ones.
constexpr double kLong = 1.012, kWide = 0.96;

class WheelErrorsTest : public ::testing::Test {
 protected:
  explicit WheelErrorsTest(int keyframes = 60, double step = 0.25) : world_(World(keyframes, step)) {}

  static test::SyntheticWorld World(int keyframes, double step) {
    test::SyntheticWorldOptions options;
    options.keyframes = keyframes;
    options.step = step;
    options.points = 15 * keyframes;
    return test::MakeSyntheticWorld(options);
  }

  // The world's map with wheels that read `length` and `turn` times the truth, and noise of `noise` of their model's.
  Map ReadWrong(double length, double turn, bool with_laser, double noise = 0.3) {
    std::normal_distribution<double> normal;
    const auto deviation = [&] { return noise * normal(generator_); };
    Map map = world_.map;
    for (const KeyframeId id : map.keyframes.Ids()) {
      Keyframe& keyframe = map.keyframes.Edit(id);
      if (!keyframe.odometry_link.has_value()) continue;
      MotionLink& link = *keyframe.odometry_link;
      if (with_laser) {
        keyframe.laser_links = {link};
        keyframe.laser_links.front().motion.covariance = 1e-6 * Eigen::Matrix3d::Identity();
      }
      const Eigen::Matrix3d covariance = CovarianceWithFloor(link.motion, world_.odometry_noise);
      const Eigen::Vector3d error =
          covariance.diagonal().cwiseSqrt().cwiseProduct(Eigen::Vector3d(deviation(), deviation(), deviation()));
      const Eigen::Vector3d factors(length, length, turn);
      link.motion.T_i_j = ExpSe2(factors.cwiseProduct(LogSe2(link.motion.T_i_j)) + error);
    }
    return map;
  }

  WheelErrors Learn(const Map& map, const WheelErrors& applied,
                    const std::optional<ScaleMeasurement>& floor = std::nullopt) const {
    return LearnWheelErrors(map, KeyframeId{0}, prior_, applied, floor, world_.Context());
  }

  test::SyntheticWorld world_;
  WheelErrors prior_ = UnknownWheelErrors(SystematicErrors{});
  std::mt19937 generator_{3};
};

TEST_F(WheelErrorsTest, LaserAndImagesShowWhatTheWheelsReadWrong) {
  const WheelErrors errors = Learn(ReadWrong(kLong, kWide, true), prior_);
  EXPECT_LT(errors.length_sigma, 0.7 * prior_.length_sigma);
  EXPECT_NEAR(errors.log_length, -std::log(kLong), 3.0 * errors.length_sigma);
  EXPECT_NEAR(errors.log_turn, -std::log(kWide), 3.0 * errors.turn_sigma);
  EXPECT_TRUE(IsNews(errors, prior_));
}

class ShortStepsTest : public WheelErrorsTest {
 protected:
  ShortStepsTest() : WheelErrorsTest(240, 0.08) {}
};

// A product of readings with themselves would make wheels of much noise read long, over short ways most.
TEST_F(ShortStepsTest, NoisyWheelsDoNotSeemToReadLong) {
  prior_ = {0.0, 0.0, 0.1, 0.1, {}};
  const Map map = ReadWrong(1.0, 1.0, true, 4.0);
  const WheelErrors first = Learn(map, prior_);
  const Map corrected = Apply(
      map, {CorrectOdometryLinks{KeyframeId{0}, std::exp(first.log_length), std::exp(first.log_turn), first.noise}});
  const WheelErrors errors = Learn(corrected, first);
  EXPECT_NEAR(errors.log_length, 0.0, 3.0 * errors.length_sigma);
  EXPECT_NEAR(errors.log_turn, 0.0, 3.0 * errors.turn_sigma);
}

TEST_F(WheelErrorsTest, NoiseBeyondTheModelsShows) {
  for (const bool with_laser : {true, false}) {
    for (const double noise : {2.0, 4.0}) {
      const WheelErrors errors = Learn(ReadWrong(1.0, 1.0, with_laser, noise), prior_);
      EXPECT_GT(errors.noise.way, 1.0 + 0.3 * (noise - 1.0)) << noise;  // images and what was configured have a say
      EXPECT_LT(errors.noise.way, 1.5 * noise) << noise;
      EXPECT_TRUE(IsNews(errors, prior_)) << noise;
    }
  }
}

TEST_F(WheelErrorsTest, WheelsAreNeverBetterThanTheirModel) {
  const WheelErrors errors = Learn(ReadWrong(1.0, 1.0, true, 0.1), prior_);
  EXPECT_EQ(errors.noise.way, 1.0);
  EXPECT_EQ(errors.noise.turn, 1.0);
}

// The links have the noise already that was learned before.
TEST_F(WheelErrorsTest, NoiseIsCountedOnce) {
  const Map map = ReadWrong(1.0, 1.0, true, 4.0);
  const WheelErrors once = Learn(map, prior_);
  const WheelErrors again = Learn(Apply(map, {CorrectOdometryLinks{KeyframeId{0}, 1.0, 1.0, once.noise}}), once);
  EXPECT_NEAR(again.noise.way, once.noise.way, 0.35 * once.noise.way);
  EXPECT_NEAR(again.noise.turn, once.noise.turn, 0.35 * once.noise.turn);
}

TEST_F(WheelErrorsTest, WithoutALaserLengthsStayTheWheelsOwn) {
  const WheelErrors errors = Learn(ReadWrong(kLong, kWide, false), prior_);
  EXPECT_EQ(errors.log_length, 0.0);
  EXPECT_EQ(errors.length_sigma, prior_.length_sigma);
  EXPECT_NEAR(errors.log_turn, -std::log(kWide), 3.0 * errors.turn_sigma);
}

TEST_F(WheelErrorsTest, WithoutALaserTheFloorShowsLengths) {
  const ScaleMeasurement floor{0.008, prior_.length_sigma};
  const WheelErrors errors = Learn(ReadWrong(1.0, 1.0, false), prior_, floor);
  EXPECT_NEAR(errors.log_length, 0.5 * floor.log_scale, 1e-12);
  EXPECT_NEAR(errors.length_sigma, prior_.length_sigma / std::sqrt(2.0), 1e-12);
  const WheelErrors by_laser = Learn(ReadWrong(1.0, 1.0, true), prior_, floor);
  EXPECT_NEAR(by_laser.log_length, 0.0, 3.0 * by_laser.length_sigma);
}

TEST_F(WheelErrorsTest, CorrectedLinksHaveNothingMoreToSay) {
  const Map map = ReadWrong(kLong, kWide, true);
  const WheelErrors errors = Learn(map, prior_);
  const Map corrected =
      Apply(map, {CorrectOdometryLinks{KeyframeId{0}, std::exp(errors.log_length), std::exp(errors.log_turn)}});
  const WheelErrors again = Learn(corrected, errors);
  EXPECT_FALSE(IsNews(again, errors));
  EXPECT_NEAR(again.log_length, errors.log_length, 0.5 * errors.length_sigma);
  EXPECT_NEAR(again.log_turn, errors.log_turn, 0.5 * errors.turn_sigma);
}

TEST_F(WheelErrorsTest, SlipsTakeNoPart) {
  Map map = ReadWrong(kLong, 1.0, true, 0.0);
  const WheelErrors without = Learn(map, prior_);
  for (const std::uint32_t id : {9U, 20U, 41U}) {
    Rigid2& read = map.keyframes.Edit(KeyframeId{id}).odometry_link->motion.T_i_j;
    read.translation *= 2.5;
    read.angle += 0.3;
  }
  const WheelErrors with = Learn(map, prior_);
  EXPECT_NEAR(with.log_length, without.log_length, 0.5 * without.length_sigma);
  EXPECT_NEAR(with.log_turn, without.log_turn, 0.5 * without.turn_sigma);
}

TEST_F(WheelErrorsTest, NothingIsLearnedWhereNothingIsLinked) {
  const WheelErrors known{0.01, -0.02, 0.001, 0.002, {2.0, 3.0}};
  const WheelErrors same = LearnWheelErrors(Map{}, KeyframeId{0}, known, known, std::nullopt, world_.Context());
  EXPECT_NEAR(same.log_length, known.log_length, 1e-15);
  EXPECT_NEAR(same.log_turn, known.log_turn, 1e-15);
  EXPECT_EQ(same.noise.way, known.noise.way);
  EXPECT_EQ(same.noise.turn, known.noise.turn);
  EXPECT_FALSE(IsNews(same, known));
}

TEST_F(WheelErrorsTest, LinksBeforeTheFirstKeepWhatTheyHave) {
  const Map map = Apply(world_.map, {CorrectOdometryLinks{KeyframeId{30}, 2.0, 1.0}});
  for (const auto& [id, keyframe] : map.keyframes) {
    if (!keyframe.odometry_link.has_value()) continue;
    const double before = world_.map.keyframes.At(id).odometry_link->motion.distance;
    EXPECT_EQ(keyframe.odometry_link->motion.distance, id.value < 30 ? before : 2.0 * before);
  }
}

}  // namespace
}  // namespace planar_vslam
