#include "planar_vslam/frontend/tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>
#include <random>
#include <string>

#include "planar_vslam/map/map_edit.h"
#include "planar_vslam/planar/scale_recovery.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

constexpr double kFrameStep = 0.05;  // m driven between frames

class TrackerTest : public ::testing::Test {
 protected:
  TrackerTest() : world_(test::MakeSyntheticWorld({})), map_(world_.map), tracker_(MakeTracker({})) {
    tracker_.Start(map_, KeyframeId{0});
  }

  Tracker MakeTracker(const PlanarPriorOptions& planar, double pixel_sigma = 1.0) const {
    return Tracker({world_.camera, world_.odometry_noise, planar, TrackerOptions{}, pixel_sigma});
  }
  TrackInput Input(double x, bool with_features = true, double pixel_noise = 0.5) {
    TrackInput input;
    input.stamp = Timestamp::FromSeconds(0.1 * static_cast<double>(++frame_));
    input.T_base_camera = world_.T_base_camera;
    input.features = with_features ? test::Observe(world_, test::SyntheticPose(x) * world_.T_base_camera, pixel_noise,
                                                   static_cast<std::uint32_t>(frame_))
                                         .features
                                   : std::make_shared<const FrameFeatures>();
    return input;
  }
  // The frame `x` metres down the path, with odometry from where the frame before was.
  TrackResult Track(double x, bool with_features = true) {
    TrackInput input = Input(x, with_features);
    input.odometry = test::ExactOdometry(world_, test::SyntheticPose(x_), test::SyntheticPose(x));
    x_ = x;
    return tracker_.Track(input, map_);
  }
  TrackResult TrackWithoutOdometry(double x, bool with_features = true) {
    return tracker_.Track(Input(x, with_features), map_);
  }
  // The frame `x` metres down the path after odometry that claims `slip` (in the base frame) on top of the true motion.
  TrackResult TrackAfterSlip(double x, const Rigid2& slip) {
    TrackInput input = Input(x);
    input.odometry = test::ExactOdometry(world_, test::SyntheticPose(x_), test::SyntheticPose(x) * Embed3(slip));
    x_ = x;
    return tracker_.Track(input, map_);
  }

  test::SyntheticWorld world_;
  Map map_;
  Tracker tracker_;
  double x_ = 0.0;
  int frame_ = 0;
};

void ExpectPose(const Rigid3& pose, const Rigid3& truth, double position, double angle) {
  const Vector6d error = LogSe3(truth.Inverse() * pose);
  EXPECT_LT(error.head<3>().norm(), position);
  EXPECT_LT(error.tail<3>().norm(), angle);
}

double PositionVariance(const TrackResult& result) { return result.covariance.diagonal().head(3).sum(); }

TEST_F(TrackerTest, FollowsTheTruePath) {
  for (double x = kFrameStep; x < 1.8; x += kFrameStep) {
    const TrackResult result = Track(x);
    ASSERT_EQ(result.status, TrackingState::kTracking) << x;
    EXPECT_FALSE(result.odometry_rejected) << x;
    EXPECT_TRUE(result.on_floor) << x;
    ExpectPose(result.T_map_base, test::SyntheticPose(x), 0.01, 0.003);
    ExpectPose(map_.keyframes.At(result.reference).T_map_base * result.T_ref_base, result.T_map_base, 1e-9, 1e-9);
    EXPECT_GT(result.inliers, 100);
  }
}

TEST_F(TrackerTest, FollowsWithoutOdometry) {
  for (double x = kFrameStep; x < 1.8; x += kFrameStep) {
    const TrackResult result = TrackWithoutOdometry(x);
    ASSERT_EQ(result.status, TrackingState::kTracking) << x;
    ExpectPose(result.T_map_base, test::SyntheticPose(x), 0.02, 0.005);
  }
}

TEST_F(TrackerTest, FollowsWhileTheCameraTurnsOnTheRobot) {
  for (int i = 1; i <= 8; ++i) {
    x_ = kFrameStep * i;
    TrackInput input = Input(x_);
    input.T_base_camera.rotation =
        input.T_base_camera.rotation * ExpSo3(Eigen::Vector3d(0.0, DegreesToRadians(1.5 * i), 0.0));
    input.features = test::Observe(world_, test::SyntheticPose(x_) * input.T_base_camera, 0.5, 1).features;
    input.odometry = test::ExactOdometry(world_, test::SyntheticPose(x_ - kFrameStep), test::SyntheticPose(x_));
    const TrackResult result = tracker_.Track(input, map_);
    ASSERT_EQ(result.status, TrackingState::kTracking) << i;
    ExpectPose(result.T_map_base, test::SyntheticPose(x_), 0.01, 0.003);
  }
}

TEST_F(TrackerTest, GivesTheSameBitsEveryTime) {
  Tracker other = MakeTracker({});
  other.Start(map_, KeyframeId{0});
  for (int i = 1; i <= 5; ++i) {
    TrackInput input = Input(kFrameStep * i);
    input.odometry =
        test::ExactOdometry(world_, test::SyntheticPose(kFrameStep * (i - 1)), test::SyntheticPose(kFrameStep * i));
    const TrackResult a = tracker_.Track(input, map_), b = other.Track(input, map_);
    EXPECT_EQ(a.T_map_base.translation, b.T_map_base.translation);
    EXPECT_EQ(a.T_map_base.rotation.coeffs(), b.T_map_base.rotation.coeffs());
    EXPECT_EQ(a.matches.landmarks, b.matches.landmarks);
  }
}

TEST_F(TrackerTest, RestsOnOdometryWhileBlindAndComesBackRelocalized) {
  TrackResult last = Track(0.1);
  ASSERT_EQ(last.status, TrackingState::kTracking);
  for (double x = 0.15; x < 0.62; x += kFrameStep) {
    const Rigid3 step = Embed3(test::ExactOdometry(world_, test::SyntheticPose(x_), test::SyntheticPose(x)).T_i_j);
    const TrackResult blind = Track(x, false);
    ASSERT_EQ(blind.status, TrackingState::kOdometry);
    ExpectPose(blind.T_map_base, last.T_map_base * step, 1e-9, 1e-9);
    EXPECT_GT(PositionVariance(blind), PositionVariance(last));
    EXPECT_GT(blind.covariance(5, 5), last.covariance(5, 5));
    EXPECT_EQ(blind.inliers, 0);
    EXPECT_FALSE(blind.wants_keyframe) << "an image without texture makes no keyframe";
    last = blind;
  }
  const TrackResult back = Track(0.65);
  ASSERT_EQ(back.status, TrackingState::kRelocalized);
  ExpectPose(back.T_map_base, test::SyntheticPose(0.65), 0.01, 0.003);
  EXPECT_LT(PositionVariance(back), PositionVariance(last));
  EXPECT_EQ(Track(0.7).status, TrackingState::kTracking);
}

TEST_F(TrackerTest, IsLostWithoutOdometryAndFindsItselfAgain) {
  ASSERT_EQ(TrackWithoutOdometry(0.05).status, TrackingState::kTracking);
  for (int i = 0; i < 5; ++i) {
    const TrackResult lost = TrackWithoutOdometry(0.1, false);
    EXPECT_EQ(lost.status, TrackingState::kLost);
    EXPECT_FALSE(lost.wants_keyframe);
  }
  const TrackResult back = TrackWithoutOdometry(1.3);  // far from where it was lost: no prediction helps
  ASSERT_EQ(back.status, TrackingState::kRelocalized);
  ExpectPose(back.T_map_base, test::SyntheticPose(1.3), 0.02, 0.005);
  EXPECT_EQ(TrackWithoutOdometry(1.35).status, TrackingState::kTracking);
}

struct Slip {
  std::string name;
  Rigid2 claimed;
};
void PrintTo(const Slip& slip, std::ostream* out) { *out << slip.name; }
class TrackerSlipTest : public TrackerTest, public ::testing::WithParamInterface<Slip> {};

TEST_P(TrackerSlipTest, VisionOverrulesOdometryThatLies) {
  Track(0.3);
  ASSERT_EQ(Track(0.35).status, TrackingState::kTracking);
  const TrackResult result = TrackAfterSlip(0.4, GetParam().claimed);
  ASSERT_EQ(result.status, TrackingState::kTracking);
  EXPECT_TRUE(result.odometry_rejected);
  ExpectPose(result.T_map_base, test::SyntheticPose(0.4), 0.02, 0.005);
  const TrackResult next = Track(0.45);
  EXPECT_EQ(next.status, TrackingState::kTracking);
  EXPECT_FALSE(next.odometry_rejected);
  ExpectPose(next.T_map_base, test::SyntheticPose(0.45), 0.01, 0.003);
}

INSTANTIATE_TEST_SUITE_P(Slips, TrackerSlipTest,
                         ::testing::Values(Slip{"FiveCentimetres", Rigid2(0.05, 0.0, 0.0)},
                                           Slip{"HalfAMetreForward", Rigid2(0.5, 0.0, 0.0)},
                                           Slip{"HalfAMetreSideways", Rigid2(0.0, -0.5, 0.0)},
                                           Slip{"TenDegrees", Rigid2(0.0, 0.0, DegreesToRadians(10.0))}),
                         [](const auto& tested) { return tested.param.name; });

class TrackerSillTest : public TrackerTest, public ::testing::WithParamInterface<Eigen::Vector3d> {
 protected:
  // The frame `x` metres down the path on a sill that tips the base, after odometry that claims `slip` on top.
  TrackResult TrackOnSill(double x, const Rigid2& slip) {
    const Rigid3 tipped = test::SyntheticPose(x) * Rigid3(ExpSo3(GetParam()), Eigen::Vector3d::Zero());
    TrackInput input = Input(x);
    input.features =
        test::Observe(world_, tipped * world_.T_base_camera, 0.5, static_cast<std::uint32_t>(frame_)).features;
    input.odometry = test::ExactOdometry(world_, test::SyntheticPose(x_), test::SyntheticPose(x) * Embed3(slip));
    x_ = x;
    const TrackResult result = tracker_.Track(input, map_);
    EXPECT_EQ(result.status, TrackingState::kTracking);
    ExpectPose(result.T_map_base, tipped, 0.02, 0.005);
    return result;
  }
};

TEST_P(TrackerSillTest, IsNoSlipOfTheWheels) {
  Track(0.3);
  ASSERT_EQ(Track(0.35).status, TrackingState::kTracking);
  const TrackResult up = TrackOnSill(0.4, Rigid2());
  EXPECT_TRUE(up.tilted);
  EXPECT_FALSE(up.odometry_rejected);
  const TrackResult down = Track(0.45);
  EXPECT_TRUE(down.tilted);
  EXPECT_FALSE(down.odometry_rejected);
  ExpectPose(down.T_map_base, test::SyntheticPose(0.45), 0.01, 0.003);
  EXPECT_FALSE(Track(0.5).tilted);
}

TEST_P(TrackerSillTest, HidesNoSlip) {
  Track(0.3);
  ASSERT_EQ(Track(0.35).status, TrackingState::kTracking);
  EXPECT_TRUE(TrackOnSill(0.4, Rigid2(0.1, 0.0, 0.0)).odometry_rejected);
}

// The camera looks to the side: a roll of the base moves all it sees up or down.
INSTANTIATE_TEST_SUITE_P(Tips, TrackerSillTest,
                         ::testing::Values(Eigen::Vector3d(0.0, -0.04, 0.0), Eigen::Vector3d(0.0, 0.04, 0.0),
                                           Eigen::Vector3d(-0.12, 0.0, 0.0), Eigen::Vector3d(0.12, 0.0, 0.0)));

TEST_F(TrackerTest, ContinuesWhenTheMapIsScaled) {
  map_.metric = false;
  for (double x = kFrameStep; x < 0.42; x += kFrameStep)
    ASSERT_EQ(TrackWithoutOdometry(x).status, TrackingState::kTracking);
  const double scale = 2.0;
  map_ = Apply(map_, {TransformMap{scale, Rigid3()}});
  tracker_.OnMapScaled(map_, scale);
  const auto scaled_truth = [this, scale](double x) {
    Rigid3 T_map_camera = test::SyntheticPose(x) * world_.T_base_camera;
    T_map_camera.translation *= scale;
    return T_map_camera * world_.T_base_camera.Inverse();
  };
  for (const double x : {0.45, 0.5, 0.55}) {
    const TrackResult result = TrackWithoutOdometry(x);
    ASSERT_EQ(result.status, TrackingState::kTracking) << x;
    ExpectPose(result.T_map_base, scaled_truth(x), 0.04, 0.005);
  }
}

TEST_F(TrackerTest, ContinuesWhenItsReferenceIsCulled) {
  tracker_.Start(map_, KeyframeId{3});
  x_ = 0.75;
  ASSERT_EQ(Track(0.8).reference, KeyframeId{3});
  map_ = Apply(map_, {EraseKeyframe{KeyframeId{3}}});
  const TrackResult result = Track(0.85);
  EXPECT_EQ(result.status, TrackingState::kTracking);
  EXPECT_TRUE(map_.keyframes.Contains(result.reference));
  ExpectPose(result.T_map_base, test::SyntheticPose(0.85), 0.01, 0.003);
  ExpectPose(map_.keyframes.At(result.reference).T_map_base * result.T_ref_base, result.T_map_base, 1e-9, 1e-9);
}

TEST_F(TrackerTest, FollowsTheReferenceWhenItMoves) {
  // Bundle adjustment shifts the whole map: the tracker's next prediction has to move along.
  Track(0.1);
  const Rigid3 T_new_old = Embed3(Rigid2(0.4, -0.3, 0.2));
  map_ = Apply(map_, {TransformMap{1.0, T_new_old}});
  const TrackResult result = Track(0.15);
  ASSERT_EQ(result.status, TrackingState::kTracking);
  EXPECT_FALSE(result.odometry_rejected);
  ExpectPose(result.T_map_base, T_new_old * test::SyntheticPose(0.15), 0.01, 0.003);
}

TEST_F(TrackerTest, WantsAKeyframeForNewViewsOnly) {
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(Track(0.0).wants_keyframe) << "standing still, frame " << i;
  bool wanted = false;
  for (double x = kFrameStep; x < 1.0 && !wanted; x += kFrameStep) wanted = Track(x).wants_keyframe;
  EXPECT_TRUE(wanted);
}

TEST_F(TrackerTest, LetsGoOfTheFloorOnARamp) {
  // The world tilted by 4 degrees: vision and odometry agree with each other, not with the floor plane.
  const Rigid3 T_tilt(ExpSo3(Eigen::Vector3d(0.0, DegreesToRadians(4.0), 0.0)), Eigen::Vector3d::Zero());
  map_ = Apply(map_, {TransformMap{1.0, T_tilt}});
  tracker_.Start(map_, KeyframeId{0});
  TrackResult result;
  for (double x = kFrameStep; x < 1.75; x += kFrameStep) result = Track(x);
  EXPECT_EQ(result.status, TrackingState::kTracking);
  EXPECT_FALSE(result.on_floor);
  ExpectPose(result.T_map_base, T_tilt * test::SyntheticPose(x_), 0.02, 0.005);
}

TEST_F(TrackerTest, PosesOfThreeDegreesOfFreedomStayOnTheFloor) {
  for (const PlanarMode mode : {PlanarMode::kSe2Xyz, PlanarMode::kHard}) {
    PlanarPriorOptions planar;
    planar.mode = mode;
    tracker_ = MakeTracker(planar);
    x_ = 0.0;
    tracker_.Start(map_, KeyframeId{0});
    TrackResult result;
    for (double x = kFrameStep; x < 0.5; x += kFrameStep) result = Track(x);
    EXPECT_TRUE(result.on_floor);
    EXPECT_EQ(result.T_map_base.translation.z(), 0.0);
    ExpectPose(result.T_map_base, test::SyntheticPose(x_), 0.01, 0.003);
  }
}

// `hard` has no such way out: where its pixels no longer fit, frames go on by odometry.
TEST_F(TrackerTest, PosesWithInflatedPixelsLetGoOfTheFloorOnARamp) {
  const Rigid3 T_tilt(ExpSo3(Eigen::Vector3d(0.0, DegreesToRadians(4.0), 0.0)), Eigen::Vector3d::Zero());
  PlanarPriorOptions planar;
  planar.mode = PlanarMode::kSe2Xyz;
  tracker_ = MakeTracker(planar);
  map_ = Apply(map_, {TransformMap{1.0, T_tilt}});
  tracker_.Start(map_, KeyframeId{0});
  TrackResult result;
  for (double x = kFrameStep; x < 1.75; x += kFrameStep) result = Track(x);
  EXPECT_EQ(result.status, TrackingState::kTracking);
  EXPECT_FALSE(result.on_floor);
  ExpectPose(result.T_map_base, T_tilt * test::SyntheticPose(x_), 0.02, 0.005);
}

TEST_F(TrackerTest, FloorPlaysNoPartWhereItIsSwitchedOff) {
  PlanarPriorOptions off;
  off.mode = PlanarMode::kOff;
  tracker_ = MakeTracker(off);
  const Rigid3 T_up(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, 0.0, 0.5));
  map_ = Apply(map_, {TransformMap{1.0, T_up}});
  tracker_.Start(map_, KeyframeId{0});
  for (const double x : {0.05, 0.1, 0.15}) ExpectPose(Track(x).T_map_base, T_up * test::SyntheticPose(x), 0.01, 0.003);
}

TEST_F(TrackerTest, TakesKeypointsAsFarOffAsThePixelSigmaSays) {
  const auto inliers = [this](double pixel_sigma) {
    Tracker tracker = MakeTracker({}, pixel_sigma);
    tracker.Start(map_, KeyframeId{0});
    frame_ = 0;
    TrackInput input = Input(kFrameStep, true, 2.0);
    input.odometry = test::ExactOdometry(world_, test::SyntheticPose(0.0), test::SyntheticPose(kFrameStep));
    return tracker.Track(input, map_).inliers;
  };
  EXPECT_GT(inliers(2.0), 1.3 * inliers(1.0));
}

TEST(TrackerOptions, NameWhatIsWrong) {
  TrackerOptions options;
  EXPECT_TRUE(options.Problems().empty());
  options.keyframe_ratio = 1.5;
  options.min_inliers = 3;
  options.frame_search_radius = 0.0;
  EXPECT_EQ(options.Problems().size(), 3U);
}

TEST_F(TrackerTest, FindsItselfAnywhereInAKnownMap) {
  tracker_.StartUnlocalized();
  x_ = 0.9;
  for (int frame = 1; frame <= 3; ++frame) {
    const double x = 0.9 + kFrameStep * frame;
    const TrackResult result = Track(x);
    if (frame < 3) {  // one look is not enough
      EXPECT_EQ(result.status, TrackingState::kLost) << frame;
      EXPECT_FALSE(tracker_.localized()) << frame;
      continue;
    }
    ASSERT_EQ(result.status, TrackingState::kRelocalized);
    EXPECT_TRUE(tracker_.localized());
    EXPECT_TRUE(result.jumped);
    ExpectPose(result.T_map_base, test::SyntheticPose(x), 0.02, 0.005);
    ExpectPose(map_.keyframes.At(result.reference).T_map_base * result.T_ref_base, result.T_map_base, 1e-9, 1e-9);
  }
  EXPECT_EQ(Track(1.1).status, TrackingState::kTracking);
}

TEST_F(TrackerTest, FindsItselfWithoutOdometryToo) {
  tracker_.StartUnlocalized();
  for (int frame = 1; frame < 3; ++frame) EXPECT_EQ(TrackWithoutOdometry(0.9).status, TrackingState::kLost);
  EXPECT_EQ(TrackWithoutOdometry(0.9).status, TrackingState::kRelocalized);
}

TEST_F(TrackerTest, StaysLostWhereNothingIsRecognised) {
  tracker_.StartUnlocalized();
  std::mt19937 generator(3);
  for (int frame = 0; frame < 6; ++frame) {
    TrackInput input = Input(0.9);
    FrameFeatures shuffled = *input.features;
    std::shuffle(shuffled.descriptors.begin(), shuffled.descriptors.end(), generator);
    input.features = std::make_shared<const FrameFeatures>(shuffled);
    EXPECT_EQ(tracker_.Track(input, map_).status, TrackingState::kLost);
  }
  EXPECT_FALSE(tracker_.localized());
}

TEST_F(TrackerTest, NoticesThatItWasCarriedAway) {
  ASSERT_EQ(Track(0.1).status, TrackingState::kTracking);
  x_ = 0.15;  // odometry knows nothing of the way from here to 1.4 m
  for (int frame = 0; frame < 4; ++frame) Track(x_, false);
  x_ = 1.4;
  TrackResult result;
  for (int frame = 0; frame < 40 && result.status != TrackingState::kRelocalized; ++frame) result = Track(1.4);
  ASSERT_EQ(result.status, TrackingState::kRelocalized);
  EXPECT_TRUE(result.jumped);
  ExpectPose(result.T_map_base, test::SyntheticPose(1.4), 0.02, 0.005);
}

TEST_F(TrackerTest, IsNotCarriedAwayByAFewLandmarksThatLookAlike) {
  ASSERT_EQ(Track(0.1).status, TrackingState::kTracking);
  x_ = 0.15;
  for (int frame = 0; frame < 4; ++frame) Track(x_, false);
  x_ = 1.4;
  for (int frame = 0; frame < 40; ++frame) {
    TrackInput input = Input(1.4);
    input.odometry = test::ExactOdometry(world_, test::SyntheticPose(x_), test::SyntheticPose(x_));
    FrameFeatures some;  // a quarter of what should be in view at 1.4 m
    for (std::size_t i = 0; i < input.features->keypoints.size(); i += 4) {
      some.keypoints.push_back(input.features->keypoints[i]);
      some.descriptors.push_back(input.features->descriptors[i]);
    }
    input.features = std::make_shared<const FrameFeatures>(some);
    ASSERT_EQ(tracker_.Track(input, map_).status, TrackingState::kOdometry) << frame;
  }
}

}  // namespace
}  // namespace planar_vslam
