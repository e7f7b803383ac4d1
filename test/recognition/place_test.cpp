#include "planar_vslam/recognition/place.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "planar_vslam/map/queries.h"
#include "support/synthetic_map.h"

namespace planar_vslam {
namespace {

constexpr KeyframeId kKeyframe{4};     // stands at 1 m
constexpr KeyframeId kFarKeyframe{0};  // stands at 0 m
constexpr double kX = 1.1;             // m down the path, where the view is taken

class PlaceTest : public ::testing::Test {
 protected:
  CameraView View(double x, double pixel_noise = 0.3) const { return ViewFrom(test::SyntheticPose(x), pixel_noise); }
  CameraView ViewFrom(const Rigid3& T_map_base, double pixel_noise = 0.3) const {
    return {test::Observe(world_, T_map_base * world_.T_base_camera, pixel_noise, 3).features, world_.T_base_camera,
            world_.camera, PlanarPriorOptions{}, 1.0};
  }
  // What keyframe 4 and those around it see.
  std::vector<LandmarkId> Around() const { return LandmarksOf(world_.map, {KeyframeId{3}, kKeyframe, KeyframeId{5}}); }
  // The view with its descriptors dealt out anew from `first` on.
  static CameraView Shuffled(CameraView view, std::ptrdiff_t first) {
    FrameFeatures features = *view.features;
    std::mt19937 generator(4);
    std::shuffle(features.descriptors.begin() + first, features.descriptors.end(), generator);
    view.features = std::make_shared<const FrameFeatures>(features);
    return view;
  }

  test::SyntheticWorld world_ = test::MakeSyntheticWorld({});
};

void ExpectPose(const Rigid3& pose, const Rigid3& truth, double position, double angle) {
  const Vector6d error = LogSe3(truth.Inverse() * pose);
  EXPECT_LT(error.head<3>().norm(), position);
  EXPECT_LT(error.tail<3>().norm(), angle);
}

void ExpectConsistent(const Placement& placement, const CameraView& view) {
  ASSERT_EQ(placement.matches.landmarks.size(), view.features->keypoints.size());
  EXPECT_EQ(static_cast<std::size_t>(placement.matches.count), ValidOnly(placement.matches.landmarks).size());
}

TEST_F(PlaceTest, RecognizesAViewByDescriptorsAlone) {
  const CameraView view = View(kX);
  const auto placement = Recognize(world_.map, view, kKeyframe);
  ASSERT_TRUE(placement.has_value());
  ExpectPose(placement->T_map_base, test::SyntheticPose(kX), 0.01, 0.003);
  ExpectConsistent(*placement, view);
  EXPECT_GT(placement->matches.count, 50);
}

TEST_F(PlaceTest, RecognizesNothingWhereDescriptorsAgreeOnNoPose) {
  EXPECT_FALSE(Recognize(world_.map, Shuffled(View(kX), 0), kKeyframe).has_value());
}

TEST_F(PlaceTest, VerifiesFromAGuessThatIsOffByAFewPixels) {
  const CameraView view = View(kX);
  const Rigid3 guess = test::SyntheticPose(kX) * Embed3(Rigid2(0.02, -0.02, 0.008));
  const auto placement = Verify(world_.map, view, Around(), guess);
  ASSERT_TRUE(placement.has_value());
  ExpectPose(placement->T_map_base, test::SyntheticPose(kX), 0.01, 0.003);
  ExpectConsistent(*placement, view);
  EXPECT_TRUE(placement->Shows(0.9));
}

TEST_F(PlaceTest, VerifiesNothingFromAGuessThatIsFarOff) {
  const Rigid3 guess = test::SyntheticPose(kX) * Embed3(Rigid2(0.3, 0.0, 0.2));
  EXPECT_FALSE(Verify(world_.map, View(kX), Around(), guess).has_value());
}

TEST_F(PlaceTest, VerifiesWithoutAGuess) {
  const auto placement = Verify(world_.map, View(kX), Around(), kFarKeyframe);
  ASSERT_TRUE(placement.has_value());
  ExpectPose(placement->T_map_base, test::SyntheticPose(kX), 0.01, 0.003);
  const auto recognized = Recognize(world_.map, View(kX), kFarKeyframe);
  ASSERT_TRUE(recognized.has_value());
  EXPECT_GT(placement->matches.count, recognized->matches.count) << "the place is more than one keyframe sees";
}

TEST_F(PlaceTest, TellsHowMuchOfWhatShouldBeInViewIsSeen) {
  const CameraView whole = View(kX);
  const auto third = static_cast<std::ptrdiff_t>(whole.features->keypoints.size() / 3);
  const auto placement = Verify(world_.map, Shuffled(whole, third), Around(), test::SyntheticPose(kX));
  ASSERT_TRUE(placement.has_value());
  EXPECT_TRUE(placement->Shows(0.25));
  EXPECT_FALSE(placement->Shows(0.45));
}

TEST_F(PlaceTest, TooFewLandmarksFixNoPose) {
  std::vector<LandmarkId> few = Around();
  few.resize(8);
  EXPECT_FALSE(Verify(world_.map, View(kX), few, test::SyntheticPose(kX)).has_value());
}

TEST_F(PlaceTest, CovarianceIsThatOfTheError) {
  double sum = 0.0;
  constexpr int kViews = 40;
  for (int i = 0; i < kViews; ++i) {
    CameraView view = View(kX);
    view.planar.mode = PlanarMode::kOff;
    view.features =
        test::Observe(world_, test::SyntheticPose(kX) * world_.T_base_camera, 1.0, static_cast<std::uint32_t>(100 + i))
            .features;
    const auto placement = Verify(world_.map, view, Around(), test::SyntheticPose(kX));
    ASSERT_TRUE(placement.has_value());
    const Vector6d error = LogSe3(test::SyntheticPose(kX).Inverse() * placement->T_map_base);
    sum += error.dot(placement->covariance.ldlt().solve(error));
  }
  const double mean = sum / kViews;  // of a chi-square with 6 dof: 6 +- 0.55
  EXPECT_GT(mean, 4.0);
  EXPECT_LT(mean, 8.5);
}

TEST_F(PlaceTest, TheFloorTakesPartOnlyWhereTheBaseMayBeOnIt) {
  const Rigid3 raised = test::SyntheticPose(kX) * Rigid3(ExpSo3({0.0, 0.0, 0.0}), Eigen::Vector3d(0.0, 0.0, 0.1));
  CameraView view = ViewFrom(raised);
  view.planar.mode = PlanarMode::kOff;
  const auto free = Verify(world_.map, view, Around(), raised);
  ASSERT_TRUE(free.has_value());
  ExpectPose(free->T_map_base, raised, 0.01, 0.003);
  view.planar.mode = PlanarMode::kHard;
  const auto held = Verify(world_.map, view, Around(), raised);
  if (held.has_value()) {
    EXPECT_EQ(held->T_map_base.translation.z(), 0.0);
    EXPECT_LT(held->matches.count, free->matches.count);
  }
}

}  // namespace
}  // namespace planar_vslam
